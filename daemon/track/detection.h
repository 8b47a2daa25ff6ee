// Finds spots of one colour anywhere in the picture.
#pragma once

#include "daemon/track/centre.h"
#include "daemon/track/point_grid.h"

#include <cstdint>
#include <span>
#include <vector>

namespace tractiond::track {

struct Spot {
  float u = 0.0F, v = 0.0F;  ///< px
  float amplitude = 0.0F;    ///< levels
};

/// Thread-bound. Allocates only in the constructor.
class Detector {
 public:
  /// \param width_px, height_px size of the largest picture
  /// \param markers expected number of markers in a plane, which also limits the spots
  Detector(int width_px, int height_px, int markers);

  /// Returns the spots of a plane, those that stand out most first, at most four for each marker; empty: none. Leaves
  /// out those that stand out from their surroundings by less than 6/255 of the range, or than 35 % of the typical one
  /// of as many as there are markers. Valid until the next call. Takes milliseconds: for the start and after gaps.
  /// \param own at most as large as the picture of the constructor (asserted)
  /// \param other plane in which spots of the colour are weaker: a spot with more than 0.6 of its amplitude there is
  /// rejected; without samples, none is
  /// \param marker need only be about right
  std::span<const Spot> find(const Plane& own, const Plane& other, const MarkerTemplate& marker);

  /// Returns the distance from the picture's border within which markers may be missed [px].
  static float border_px(const Plane& plane, const MarkerTemplate& marker);

 private:
  struct Peak {
    float response;
    int x, y;  ///< sample
  };

  template <typename Sample>
  void integrate(const Plane& plane);
  void collectPeaks(const Plane& plane, const MarkerTemplate& marker);

  int markers_;
  std::vector<std::uint32_t> integral_;  ///< sums of all samples above and to the left
  std::vector<float> response_;
  std::vector<Peak> peaks_;
  std::vector<Guess> guesses_;
  std::vector<Centre> centres_;
  std::vector<Spot> spots_;
  PointGrid grid_;
};

}  // namespace tractiond::track
