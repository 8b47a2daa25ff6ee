// How the noise of a pixel grows with its light, from the same pixels of successive still pictures.
#pragma once

#include "daemon/track/lattice.h"
#include "daemon/track/plane.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor.
class PixelNoise {
 public:
  explicit PixelNoise(int markers);

  void start();

  /// One layer of one frame; the same layers in the same order in each frame. `first`: the layer's first marker.
  /// `between`: from a marker to bare gel [px]. Nothing but pixels whose place is flat is looked at, so that a faint
  /// motion is no noise.
  void add(const Plane& plane, int first, std::span<const Vector> place_px, Vector between,
           std::span<const std::uint8_t> valid);

  /// Variance of one of the camera's samples per level of brightness [levels]; 0 where none shows.
  float perLevel() const;

 private:
  struct Pixels {
    std::vector<float> before;  ///< per marker, its level in the frame before; -1: none
    double variance = 0.0;      ///< sum over frames of half the differences' variance [levels^2]
    double level = 0.0;         ///< sum over frames of the mean level
    int frames = 0;
  };

  static void addTo(Pixels& pixels, const Plane& plane, int first, std::span<const Vector> place_px, Vector offset,
                    std::span<const std::uint8_t> valid);

  Pixels onMarkers_, between_;
  double leastContrast_ = 0.0;  ///< levels
};

}  // namespace tractiond::track
