// Measures how the noise of a pixel grows with its brightness, from the same pixels of successive still pictures.
#pragma once

#include "daemon/track/lattice.h"
#include "daemon/track/plane.h"

#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor.
class PixelNoise {
 public:
  /// \param markers number of markers of all layers
  explicit PixelNoise(int markers);

  /// Forgets the frames added so far.
  void start();

  /// Adds one layer of one frame; each frame must add the same layers in the same order. Compares the pixels at the
  /// markers' centres and at bare gel with those of the frame before: the picture is flat there, so that a small motion
  /// does not count as noise. Ignores pixels that are nearly black or saturated here or in the frame before; of
  /// centres, or of bare gel, all pixels of a layer if fewer than 30 remain.
  /// \param first index of the layer's first marker
  /// \param place_px, valid of this layer's markers
  /// \param between offset from a marker to bare gel [px]
  void add(const Plane& plane, int first, std::span<const Vector> place_px, Vector between,
           std::span<const std::uint8_t> valid);

  /// Returns the increase of the variance of one of the camera's samples per level of brightness [levels]; 0 if it does
  /// not grow, or if the frames do not determine it: fewer than two, or markers hardly brighter or darker than the gel.
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
