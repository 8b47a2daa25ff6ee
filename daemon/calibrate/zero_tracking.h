// Follows the zero while nothing touches, as scales do: heat moves the picture and bends the gel, more slowly than any
// touch.
#pragma once

#include "daemon/calibrate/picture_motion.h"
#include "daemon/records/marker_field.h"

#include <optional>
#include <vector>

namespace tractiond::calibrate {

/// Fits displacements that vary smoothly across each layer: by cubic polynomials in the picture, or linear ones where a
/// layer has fewer than 60 markers. Heat is smooth, touches are not. Reentrant; immutable once made.
class SmoothFit {
 public:
  /// Copies what it needs of the sensor.
  explicit SmoothFit(const sensor::Sensor& sensor);

  /// Writes the fit of all markers, 2 M. Returns false if less than half of a layer is valid.
  bool operator()(const Displacements& displacements, std::span<float> smooth_px) const;

 private:
  static constexpr int kTerms = 10;
  Eigen::Matrix<double, Eigen::Dynamic, kTerms, Eigen::RowMajor> basis_;  ///< M rows
  std::vector<int> ends_;                                                 ///< of the layers
};

/// Thread-bound. Copies what it needs of the sensor. Allocates only when made, and at its first frame.
class ZeroTracking {
 public:
  static constexpr double kWindow_s = 4.0;         ///< the mean over so long tells whether something touches
  static constexpr double kHeat_K_per_s = 2.5e-3;  ///< deviation of how fast the temperature changes
  static constexpr double kMost_K = 10.0;          ///< bound of the deviation of the temperature
  static constexpr double kResumed_K = 3.0;        ///< bound of it after a start with the zero of an earlier run

  /// \param follows false: the drift is measured, and not taken off
  explicit ZeroTracking(const sensor::Sensor& sensor, bool follows = true);

  /// Says that the next frame's zero is of an earlier run: nobody knows how warm it was then.
  /// \param taken_ns RestPose::taken_ns
  void resume(std::int64_t taken_ns) { resumed_ns_ = taken_ns; }

  // Both are to be called for each frame, with track::CreepMemory::advance() between them.

  /// Takes the drift off the displacements: sets `elastic_px`, `drift_px`, `drift` and `heatDeviation_K`. Another zero
  /// begins without drift.
  void takeOff(MarkerField& field);
  /// Follows the drift by what is left in `elastic_px`, at the end of a window in which nothing touched, and in which
  /// the picture did not change but for noise and shifts. Frames with kFewMarkers or kTorn, or without a zero, are not
  /// part of a window.
  void watch(const MarkerField& field);

 private:
  void begin(const MarkerField& field);
  void add(const MarkerField& field);
  bool changed();
  void endWindow(const FrameInfo& last);
  double warmthDeviation(const FrameInfo& now) const;  ///< [K]

  const bool follows_;
  const PictureMotionFit motion_;
  const SmoothFit smooth_;
  BulgeSearch bulges_;
  Id zero_{};
  std::optional<std::int64_t> resumed_ns_;    ///< CLOCK_REALTIME of the zero of an earlier run
  std::vector<float> drift_px_;               ///< 2 M, from the zero; smooth
  std::vector<float> mean_px_;                ///< 2 M, of the window, without the drift; until its end the sum
  std::vector<float> change_px_;              ///< 2 M, deviation over the window; until its end the sum of squares
  Eigen::Vector2d shift_px_{};                ///< sum over the window of the frames' mean displacements
  double variance_px2_ = 0.0;                 ///< sum over the window of the frames' mean variances, as stated
  std::vector<int> shown_;                    ///< M, frames of the window that show the marker
  std::vector<std::uint8_t> enough_;          ///< M, 1: at least half of them do
  std::vector<float> smooth_px_;              ///< 2 M, of the window's mean
  int frames_ = 0;                            ///< of the window
  std::int64_t from_ns_ = 0, rested_ns_ = 0;  ///< begin of the window; end of the last one that was followed
  FrameExtras rested_;                        ///< sent with the frame at rested_ns_
  RestDrift now_;
};

/// Tells when a drift is large enough to warn of.
class DriftWarning {
 public:
  /// Returns whether the drift at the edge of the picture exceeds five deviations of the sensor's picture motion.
  /// Returns true once, and again only after a call has seen less than half of that, or another zero.
  bool take(const sensor::Sensor& sensor, const MarkerField& field);

 private:
  Id zero_{};
  bool warned_ = false;
};

}  // namespace tractiond::calibrate
