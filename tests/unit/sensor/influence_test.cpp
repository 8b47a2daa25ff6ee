#include "sensor/elastic/influence.h"

#include <gtest/gtest.h>

namespace sensor::elastic {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::Vector3d;

Sensor smallSensor() {
  Sensor sensor;
  sensor.layers.resize(1);
  sensor.layers[0].columns = 5;
  sensor.layers[0].rows = 3;
  sensor.nodes.columns = 3;
  sensor.nodes.rows = 1;
  return sensor;
}

TEST(Influence, IsTheProjectionOfTheDisplacement) {
  const Sensor sensor = smallSensor();
  const Points markers = markerPositions(sensor.layers);
  const MatrixXd influence = toImage(sensor, displacementMatrix(sensor, Model::kBlock));
  const MatrixXd displacement = blockDisplacement(sensor.gel, markers, nodePositions(sensor.nodes));
  const Projection project(sensor.camera, sensor.gel.size.z());
  constexpr double kForce = 1e-3;  // [N], so small that the projection is linear
  for (Index column = 0; column < influence.cols(); ++column)
    for (Index m = 0; m < markers.cols(); ++m) {
      const Vector3d u = kForce * displacement.col(column).segment<3>(3 * m);
      const Eigen::Vector2d moved = project(markers.col(m) + u) - project(markers.col(m) - u);
      const Eigen::Vector2d predicted = 2.0 * kForce * influence.col(column).segment<2>(2 * m);
      EXPECT_LT((moved - predicted).norm(), 1e-6 * influence.col(column).norm() * kForce);
    }
}

}  // namespace
}  // namespace sensor::elastic
