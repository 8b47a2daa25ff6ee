// Markers of a sensor as a tracker would report them.
#pragma once

#include "daemon/calibrate/picture_motion.h"

#include <functional>
#include <random>
#include <vector>

namespace tractiond::calibrate {

inline Eigen::Matrix2Xd projected(const sensor::Sensor& sensor, const sensor::Points& points) {
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  Eigen::Matrix2Xd pixels(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) pixels.col(i) = project(points.col(i));
  return pixels;
}

/// (u, v) marker after marker, with noise.
struct Seen {
  std::vector<float> value_px;
  std::vector<std::uint8_t> valid;
  std::vector<float> variance_px2;

  Seen(const Eigen::Matrix2Xd& pixels, double noise_px, unsigned seed)
      : valid(static_cast<std::size_t>(pixels.cols()), 1)
      , variance_px2(static_cast<std::size_t>(pixels.cols()), static_cast<float>(noise_px * noise_px)) {
    std::mt19937 generator(seed);
    std::normal_distribution<double> noise(0.0, noise_px);
    for (const double value : pixels.reshaped()) value_px.push_back(static_cast<float>(value + noise(generator)));
  }

  operator Displacements() const { return {value_px, valid}; }
};

}  // namespace tractiond::calibrate
