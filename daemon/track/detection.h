// Spots of one colour anywhere in the picture, without knowing where to look.
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

/// Thread-bound. Allocates only in the constructor. Takes milliseconds: for the start and after gaps.
class Detector {
 public:
  /// Size of the picture, and how many markers a colour has.
  Detector(int width_px, int height_px, int markers);

  /// Strongest first; at most four times as many as there are markers. `marker` need only be about right. `other` may
  /// be none: then no spot is refused for its colour.
  std::span<const Spot> find(const Plane& own, const Plane& other, const MarkerTemplate& marker);

  /// Nearer to the picture's border markers may not be found.
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
