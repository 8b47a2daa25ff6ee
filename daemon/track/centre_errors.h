// Estimates the errors of the markers' centres, and rejects what is not a marker.
#pragma once

#include "daemon/records/marker_field.h"
#include "daemon/track/centre.h"
#include "daemon/track/lattice.h"

#include <cstdint>
#include <span>
#include <vector>

namespace tractiond::track {

/// Thread-bound. Allocates only in the constructor. Arrays are by marker. The shape of a marker states how much it
/// differs from a disc: the rms misfit of its template beyond the noise, as a share of the amplitude.
class CentreErrors {
 public:
  /// The typical shape is 0, the strictest, until learnShape() or forgetShape().
  /// \param markers number of markers of all layers
  /// \param spacing_px smallest distance between neighbours of a layer
  /// \param zeroFrames number of frames that a rest pose averages, above 0
  CentreErrors(int markers, float spacing_px, int zeroFrames);

  /// Takes the noise and the markers' shapes (0 if its `oddity` is empty) from the zero in force, which must have as
  /// many markers and need not outlive the call.
  void adopt(const RestPose& pose);
  /// Returns the standard deviation of a pixel [levels]; until adopt() that of a typical camera.
  float noise() const { return noise_; }
  /// Sets the noise to that of a typical camera, 3 units, unless adopt() was called.
  /// \param unit levels in 1/255 of the range
  void setUnit(float unit);

  /// Learns the typical shape of this gel's markers from the present frame: three quarters of them have a smaller one,
  /// but at most 0.15. Subtracts noise(), so setUnit() or adopt() must have been called. Has no effect without valid
  /// markers.
  /// \param valid 1: the marker was found
  void learnShape(std::span<const Centre> centres, std::span<const std::uint8_t> valid);
  /// Sets the typical shape to the largest one that a marker may have, until learnShape() is called.
  void forgetShape();
  /// Replaces the shape of each valid marker by that in the present frame, at most 0.3. Used while a zero is taken,
  /// which will state it.
  void learnOwnShapes(std::span<const Centre> centres, std::span<const std::uint8_t> valid);

  /// Returns whether the misfit of a fitted centre is small enough for this marker: at most (2 noise)^2 + (a (shape +
  /// 0.16))^2, a the amplitude, shape that of the marker, at least the typical one and at most twice that.
  /// \param centre one that was found
  bool isMarker(int marker, const Centre& centre) const;

  /// Fits the disc of a marker as an ellipse of any size.
  class DeformedFits {
   public:
    /// Makes the centre of such a fit the marker's and returns true, if its misfit is at most `mostMisfit`.
    virtual bool adopt(int marker, float mostMisfit) = 0;

   protected:
    ~DeformedFits() = default;
  };

  /// Computes the variances of a layer's valid centres. A marker whose shape does not fit its strain (dust at its edge,
  /// the fringe of a reflection, white pixels) is displaced by that: its variance is increased or, if the misfit is too
  /// large, `valid` is set to 0.
  /// \param pixels used samples of the template
  /// \param frames for which the marker was followed, up to 2 kMemory - 1
  /// \param deformed is asked for strained markers, at most 64
  void weigh(const Lattice& lattice, int pixels, std::span<const Centre> centres, std::span<const Vector> displacement,
             std::span<const float> restAmplitude, std::span<const std::uint8_t> frames, DeformedFits& deformed,
             std::span<std::uint8_t> valid);
  /// Returns the variance of each of a centre's two coordinates, as weigh() computed it last; by marker. The span stays
  /// in place. That of a marker that is not valid has no meaning.
  std::span<const float> variance_px2() const { return variance_; }

  /// Time constant of the running means [frames]; they are as good as plain means of twice as many.
  static constexpr int kMemory = 8;
  /// Returns the weight of the n-th frame, the newest, in such a mean: 1/n, at least 1/kMemory.
  /// \param n from 1
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
  std::vector<float> shape_;   ///< the same of each marker
  std::vector<float> excess_;  ///< of misfit, in noise variances, mean over the frames
  std::vector<float> variance_, shares_;
};

}  // namespace tractiond::track
