#include "sensor/sensor.h"

#include <gtest/gtest.h>

namespace {

using sensor::MarkerLayer;
using sensor::NodeGrid;

TEST(Gel, MarkersComeLayerAfterLayerRowAfterRowColumnsAlongX) {
  const sensor::Sensor paper;
  const sensor::Points points = sensor::markerPositions(paper.layers);
  ASSERT_EQ(points.cols(), 1152);
  EXPECT_EQ(paper.markerCount(), 1152);
  EXPECT_TRUE(points.col(0).isApprox(Eigen::Vector3d(-34.5e-3, -34.5e-3, 6e-3)));
  EXPECT_TRUE(points.col(1).isApprox(Eigen::Vector3d(-31.5e-3, -34.5e-3, 6e-3)));
  EXPECT_TRUE(points.col(24).isApprox(Eigen::Vector3d(-34.5e-3, -31.5e-3, 6e-3)));
  EXPECT_TRUE(points.col(575).isApprox(Eigen::Vector3d(34.5e-3, 34.5e-3, 6e-3)));
  EXPECT_TRUE(points.col(576).isApprox(Eigen::Vector3d(-33e-3, -33e-3, 8e-3)));
  EXPECT_EQ(paper.layers[0].colour, sensor::Colour::kBlue);
  EXPECT_EQ(paper.layers[1].colour, sensor::Colour::kRed);
}

TEST(Gel, NodesLieOnTheSurfaceCentredOnTheirGrid) {
  NodeGrid grid;
  grid.columns = 3;
  grid.rows = 2;
  grid.pitch = 2e-3;
  grid.centre = {1e-3, -1e-3};
  const sensor::Points points = sensor::nodePositions(grid);
  ASSERT_EQ(points.cols(), 6);
  EXPECT_TRUE(points.col(0).isApprox(Eigen::Vector3d(-1e-3, -2e-3, 0)));
  EXPECT_TRUE(points.col(5).isApprox(Eigen::Vector3d(3e-3, 0, 0)));
  EXPECT_TRUE(points.rowwise().mean().isApprox(Eigen::Vector3d(1e-3, -1e-3, 0)));
}

}  // namespace
