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

// Indices in smallSensor: markers at x = -6..6 mm, y = -3..3 mm; the middle node at the origin.
constexpr Index kMarkerRight = 1 * 5 + 3, kMarkerUp = 2 * 5 + 2, kMiddleNode = 1;

TEST(Influence, PressingDrivesMarkersApartAndDraggingTakesThemAlong) {
  for (const Model model : {Model::kBlock, Model::kHalfSpace}) {
    const MatrixXd influence = toImage(smallSensor(), displacementMatrix(smallSensor(), model));
    ASSERT_EQ(influence.rows(), 2 * 15);
    ASSERT_EQ(influence.cols(), 3 * 3);
    const auto pixels = [&](Index marker, int axis) {
      return influence.col(3 * kMiddleNode + axis).segment<2>(2 * marker).eval();
    };
    EXPECT_GT(pixels(kMarkerRight, 2).x(), 0.0);
    EXPECT_LT(pixels(kMarkerUp, 2).y(), 0.0);  // y is up, v is down
    EXPECT_GT(pixels(kMarkerUp, 0).x(), 0.0);
    EXPECT_LT(pixels(kMarkerRight, 1).y(), 0.0);
  }
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

TEST(Influence, ProgressEndsAtOne) {
  double last = 0.0;
  displacementMatrix(smallSensor(), Model::kBlock, [&](double done) {
    EXPECT_GE(done, last);
    last = done;
  });
  EXPECT_EQ(last, 1.0);
}

}  // namespace
}  // namespace sensor::elastic
