// Estimates the errors of the markers' centres, and rejects what is not a marker.
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
  /// \param zeroFrames number of frames that a rest pose averages
  CentreErrors(int markers, float spacing_px, int zeroFrames);

  // The noise and the markers' shapes in force.
  void adopt(const RestPose& pose);
  float noise() const { return noise_; }  ///< standard deviation of a pixel [levels]
  /// Sets the noise of a typical camera, until the noise is known. \param unit levels in 1/255 of the range
  void setUnit(float unit);

  /// Learns how far this gel's markers typically are from discs, from those of this frame.
  void learnShape(std::span<const Centre> centres, std::span<const std::uint8_t> valid);
  void forgetShape();
  /// Learns how far each marker is from a disc, from this frame, while a zero is taken.
  void learnOwnShapes(std::span<const Centre> centres, std::span<const std::uint8_t> valid);
  /// Restores the values of the zero in force.
  void restoreOwnShapes();

  /// Returns whether what was fitted can be this marker.
  bool isMarker(int marker, const Centre& centre) const;

  /// Estimates the variances of a layer's valid centres. The centre of a marker without the shape expected under its
  /// strain (dust at its edge, the fringe of a reflection, white pixels) is biased: its variance grows, or it becomes
  /// invalid. \param pixels number of pixels of the template \param frames for which the marker was followed, up to
  /// 2 kMemory - 1 \param adoptDeformed fits a marker's disc as an ellipse of any size; if the misfit is at most the
  /// given one, adopts its centre and returns true. Called for at most 64 strained markers.
  void weigh(const Lattice& lattice, int pixels, std::span<const Centre> centres, std::span<const Vector> displacement,
             std::span<const float> restAmplitude, std::span<const std::uint8_t> frames,
             const std::function<bool(int, float)>& adoptDeformed, std::span<std::uint8_t> valid);
  std::span<const float> variance_px2() const { return variance_; }

  /// Time constant of the means, in frames: they are as good as means over twice as many frames.
  static constexpr int kMemory = 8;
  /// Returns the weight of the n-th frame, the newest, in such a mean.
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
  std::vector<float> shape_;   ///< of each marker, likewise
  std::vector<float> restShape_;
  std::vector<float> excess_;  ///< of misfit, in noise variances, mean over the frames
  std::vector<float> variance_, shares_;
};

}  // namespace tractiond::track
