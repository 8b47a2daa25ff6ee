// How far a marker's centre may be off, and what is no marker at all.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/track/centre.h"
#include "daemon/track/lattice.h"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor. Arrays are by marker.
class CentreErrors {
 public:
  /// A rest pose averages `zeroFrames` frames.
  CentreErrors(int markers, float spacing_px, int zeroFrames);

  /// The noise and the markers' shapes in force.
  void adopt(const RestPose& pose);
  float noise() const { return noise_; }  ///< standard deviation of a pixel [levels]
  /// What a typical camera's is, as long as none is known. `unit`: levels in 1/255 of the range.
  void setUnit(float unit);

  /// How far this gel's markers typically are from discs: from the present frame's.
  void learnShape(std::span<const Centre> centres, std::span<const std::uint8_t> valid);
  void forgetShape();
  /// How far each of them is, as long as a zero is taken that will tell: from the present frame's.
  void learnOwnShapes(std::span<const Centre> centres, std::span<const std::uint8_t> valid);
  /// Those of the zero in force again.
  void restoreOwnShapes();

  /// Could what was fitted be this marker?
  bool isMarker(int marker, const Centre& centre) const;

  /// The variances of a layer's valid centres. A marker that has not the shape that it should have under its strain
  /// (dust at its edge, the fringe of a reflection, white pixels) is pulled aside: it counts for less or, where it is
  /// odder than that, is made invalid. `pixels`: of the template; `frames`: that the marker was followed for, up to
  /// 2 kMemory - 1; `adoptDeformed`: fits a marker's disc as an ellipse of any size and, where that leaves at most so
  /// much, makes its centre the marker's and returns true. Called for at most 64 markers, for those that are strained.
  void weigh(const Lattice& lattice, int pixels, std::span<const Centre> centres, std::span<const Vector> displacement,
             std::span<const float> restAmplitude, std::span<const std::uint8_t> frames,
             const std::function<bool(int, float)>& adoptDeformed, std::span<std::uint8_t> valid);
  std::span<const float> variance_px2() const { return variance_; }

  /// Frames over which means forget: they are as good as those of twice as many.
  static constexpr int kMemory = 8;
  /// Of the newest frame in such a mean, of which it is the n-th.
  static float weightOf(int n);

 private:
  float shapeOf(int marker) const;
  float strainAt(const Lattice& lattice, int marker, std::span<const Vector> displacement,
                 std::span<const std::uint8_t> valid) const;

  float spacing_px_;
  float perZeroFrame_;
  float noise_;
  bool measured_ = false;
  float shotNoise_ = 0.0F;     ///< variance per level
  float light_ = 0.0F;         ///< levels at which noise_ is stated
  float typicalShape_ = 0.0F;  ///< rms misfit of most markers beyond the noise, share of the amplitude
  std::vector<float> shape_;   ///< of each, likewise
  std::vector<float> restShape_;
  std::vector<float> excess_;  ///< of misfit, in noise variances, mean over the frames
  std::vector<float> variance_, shares_;
};

}  // namespace tractiond::track
