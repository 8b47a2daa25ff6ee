// Frames of displacements, as a tracker finds them.
#pragma once

#include "daemon/calibrate/picture_motion.h"
#include "daemon/records/marker_field.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace tractiond::calibrate {

inline constexpr double kNoise_px = 0.016, kRate_Hz = 60.0;

/// Few markers, so that the mechanics take no time.
inline sensor::Sensor coarse() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) {
    layer.columns = layer.rows = 12;
    layer.pitch = 6e-3;
  }
  return sensor;
}

/// Frames of a gel under a press of a strength, at 60 frames/s.
class Frames {
 public:
  explicit Frames(const sensor::Sensor& sensor)
      : markers_(sensor::markerPositions(sensor.layers))
      , motion_(sensor) {
    field_.resize(sensor.markerCount());
    std::fill(field_.valid.begin(), field_.valid.end(), std::uint8_t{1});
    std::fill(field_.variance_px2.begin(), field_.variance_px2.end(), static_cast<float>(kNoise_px * kNoise_px));
    field_.validCount = sensor.markerCount();
    field_.info.times.received_ns = 1'000'000'000;
    field_.zero[0] = 1;
  }

  /// \param moved_px 2 M
  const MarkerField& next(const Eigen::VectorXd& moved_px) {
    field_.info.times.received_ns += static_cast<std::int64_t>(1e9 / kRate_Hz);
    for (Eigen::Index i = 0; i < moved_px.size(); ++i) {
      field_.displacement_px[static_cast<std::size_t>(i)] =
          static_cast<float>(moved_px[i] + kNoise_px * normal_(generator_));
    }
    return field_;
  }

  const MarkerField& next(double press_px, const Eigen::Vector4d& motion = Eigen::Vector4d::Zero()) {
    field_.info.times.received_ns += static_cast<std::int64_t>(1e9 / kRate_Hz);
    for (Eigen::Index i = 0; i < markers_.cols(); ++i) {
      const Eigen::Vector2d away = markers_.col(i).head<2>();
      Eigen::Vector2d moved = press_px * away / 6e-3 * std::exp(-away.squaredNorm() / (2 * 64e-6));
      moved.y() = -moved.y();
      moved += motion_.at(static_cast<int>(i), motion);
      for (int c = 0; c < 2; ++c) {
        field_.displacement_px[2 * i + c] = static_cast<float>(moved[c] + kNoise_px * normal_(generator_));
      }
    }
    return field_;
  }

  MarkerField& field() { return field_; }

 private:
  sensor::Points markers_;
  PictureMotionFit motion_;
  MarkerField field_;
  std::mt19937 generator_{5};
  std::normal_distribution<double> normal_;
};

}  // namespace tractiond::calibrate
