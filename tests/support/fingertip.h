// A fingertip's grids of nodes and markers, as bodies for tests.
#pragma once

#include "sensor/elastic/influence.h"
#include "sensor/influence_file.h"
#include "sensor/sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::test {

inline constexpr double kTipRadius = 10e-3;  // of the touched surface [m]

/// Returns the point of a ball about the tip that has the distance and direction along it that `flat` has in a plane of
/// its depth.
inline Eigen::Vector3d onTip(const Eigen::Vector3d& flat) {
  const double distance = flat.head<2>().norm(), radius = kTipRadius - flat.z(), angle = distance / radius;
  const Eigen::Vector2d across = std::sin(angle) * radius * flat.head<2>() / std::max(distance, 1e-12);
  return {across.x(), across.y(), kTipRadius - radius * std::cos(angle)};
}

/// Returns a block with the grids of the fingertip in planes.
inline sensor::Sensor flatTip(double markerPitch = 1e-3) {
  sensor::Sensor sensor;
  sensor.layers = {{.columns = 15, .rows = 15, .pitch = markerPitch, .depth = 2e-3, .diameter = 0.3e-3}};
  sensor.nodes = {.columns = 17, .rows = 17, .pitch = 1.3e-3};
  sensor.camera.position = {0.0, 0.0, 45e-3};
  return sensor;
}

/// Returns a body with the grids of a sensor, as an influence file would say it.
inline sensor::Body bodyOn(const sensor::Sensor& sensor, Eigen::MatrixXd influence) {
  return {.file = "body.npz",
          .youngsModulus = sensor.gel.youngsModulus,
          .influence = std::move(influence),
          .nodes = sensor::nodePositions(sensor),
          .normals = sensor::nodeNormals(sensor),
          .areas = sensor::nodeAreas(sensor),
          .markers = sensor::markerPositions(sensor),
          .errors = {}};
}

/// Returns a fingertip's grids. The influence is that of a half-space under the flat ones: smooth, and nothing more.
inline sensor::Sensor fingertip(double markerPitch = 1e-3) {
  sensor::Sensor sensor = flatTip(markerPitch);
  sensor::Body body = bodyOn(sensor, displacementMatrix(sensor, sensor::elastic::Model::kHalfSpace));
  for (auto point : body.nodes.colwise()) point = onTip(point);
  for (auto point : body.markers.colwise()) point = onTip(point);
  body.normals = (Eigen::Vector3d(0, 0, kTipRadius).replicate(1, body.nodes.cols()) - body.nodes) / kTipRadius;
  EXPECT_TRUE(sensor::setBody(sensor, std::move(body)));
  return sensor;
}

}  // namespace tractiond::test
