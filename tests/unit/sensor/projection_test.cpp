#include "sensor/projection.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

namespace {

using sensor::Camera;
using sensor::Projection;

constexpr double kThickness = 40e-3;

/// Everything at once: pose, distortion, two refracting interfaces.
Camera awkwardCamera() {
  Camera camera;
  camera.position = {4e-3, -3e-3, 152e-3};
  camera.rotation = {0.03, -0.02, 0.05};
  camera.k1 = -0.12;
  camera.k2 = 0.03;
  camera.gelIndex = 1.41;
  camera.windowIndex = 1.49;
  camera.windowThickness = 5e-3;
  return camera;
}

std::vector<Eigen::Vector3d> somePoints() {
  return {{0, 0, 6e-3}, {4e-3, -3e-3, 7e-3}, {30e-3, 20e-3, 8e-3}, {-34.5e-3, 34.5e-3, 6e-3}, {1e-3, -36e-3, 5e-3}};
}

TEST(Projection, PaperScaleAndHandedness) {
  const Projection project(Camera{}, kThickness);
  const Eigen::Vector2d centre = project({0, 0, 7e-3});
  EXPECT_NEAR(centre.x(), 319.5, 1e-9);
  EXPECT_NEAR(centre.y(), 239.5, 1e-9);
  const Eigen::Vector2d right = project({0.15625e-3, 0, 7e-3}), up = project({0, 0.15625e-3, 7e-3});
  EXPECT_NEAR(right.x(), 320.5, 1e-9);
  EXPECT_NEAR(up.y(), 238.5, 1e-9);
  // Towards the camera means away from the picture's centre.
  EXPECT_GT(project({10e-3, 0, 8e-3}).x(), project({10e-3, 0, 6e-3}).x());
}

TEST(Projection, RotationTurnsThePicture) {
  // A camera turned by +angle about its optical axis, Z: the picture turns with the rotation vector's sense, from u to
  // v.
  Camera camera;
  camera.rotation = {0, 0, 0.1};
  const Eigen::Vector2d pixel = Projection(camera, kThickness)({10e-3, 0, 7e-3}) - camera.principal_px;
  EXPECT_NEAR(std::atan2(pixel.y(), pixel.x()), 0.1, 1e-12);
  // About X by +angle: what was on the axis moves to -v.
  camera.rotation = {0.1, 0, 0};
  EXPECT_NEAR(Projection(camera, kThickness)({0, 0, 7e-3}).y(), 239.5 - 960 * std::tan(0.1), 1e-9);
}

TEST(Projection, RadialDistortionScalesTheDistanceFromThePrincipalPoint) {
  Camera camera;
  camera.k1 = -0.2;
  camera.k2 = 0.5;
  const Eigen::Vector3d point(30e-3, -20e-3, 7e-3);
  const Eigen::Vector2d straight = Projection(Camera{}, kThickness)(point) - camera.principal_px;
  const Eigen::Vector2d distorted = Projection(camera, kThickness)(point) - camera.principal_px;
  const double r2 = (0.03 * 0.03 + 0.02 * 0.02) / (0.15 * 0.15);
  EXPECT_TRUE(distorted.isApprox((1 - 0.2 * r2 + 0.5 * r2 * r2) * straight, 1e-12));
}

TEST(Projection, RefractionObeysSnell) {
  const Camera camera = awkwardCamera();
  const Projection project(camera, kThickness);
  // Undo distortion and pose of the picture, walk the ray back by Snell's law in vector form, arrive at the point.
  const Eigen::Matrix3d toGel =
      (Eigen::AngleAxisd(camera.rotation.norm(), camera.rotation.normalized()).toRotationMatrix() *
       Eigen::Vector3d(1, -1, -1).asDiagonal())
          .transpose();
  for (const Eigen::Vector3d& point : somePoints()) {
    const Eigen::Vector2d distorted = (project(point) - camera.principal_px) / camera.focal_px;
    Eigen::Vector2d ideal = distorted;
    for (int i = 0; i < 50; ++i) {
      const double r2 = ideal.squaredNorm();
      ideal = distorted / (1 + camera.k1 * r2 + camera.k2 * r2 * r2);
    }
    Eigen::Vector3d direction = (toGel * ideal.homogeneous()).normalized();
    Eigen::Vector3d place = camera.position;
    double index = 1.0;
    for (const auto& [plane, next] : {std::pair{kThickness + camera.windowThickness, camera.windowIndex},
                                      {kThickness, camera.gelIndex},
                                      {point.z(), 1.0}}) {
      place += direction * (plane - place.z()) / direction.z();
      const Eigen::Vector2d sine = direction.head<2>() * index / next;
      direction << sine, -std::sqrt(1 - sine.squaredNorm());
      index = next;
    }
    EXPECT_NEAR((place - point).norm(), 0.0, 1e-12);
  }
}

TEST(Projection, AspectScalesVAfterTheDistortion) {
  Camera camera = awkwardCamera();
  const Projection square(camera, kThickness);
  camera.aspect = 1.035;
  const Projection project(camera, kThickness);
  for (const Eigen::Vector3d& point : somePoints()) {
    const Eigen::Vector2d expected = square(point) - camera.principal_px, found = project(point) - camera.principal_px;
    EXPECT_NEAR(found.x(), expected.x(), 1e-12);
    EXPECT_NEAR(found.y(), 1.035 * expected.y(), 1e-12);
  }
}

/// The picture's motion is that of a camera that turns, of a longer lens, of a sensor that is shifted.
TEST(Projection, MotionIsThatOfTheCamera) {
  constexpr double kStep = 1e-6;
  for (const double aspect : {1.0, 1.035, 0.5}) {
    Camera camera;
    camera.aspect = aspect;
    camera.k1 = -0.12;
    const Projection project(camera, kThickness);
    Camera shiftedU = camera, shiftedV = camera, longer = camera, turned = camera;
    shiftedU.principal_px.x() += kStep;
    shiftedV.principal_px.y() += kStep;
    longer.focal_px *= 1.0 + kStep;
    turned.rotation.z() += kStep;
    for (const Eigen::Vector3d& point : somePoints()) {
      const auto motion = project.motionOf(project(point));
      int column = 0;
      for (const Camera& moved : {shiftedU, shiftedV, longer, turned}) {
        const Eigen::Vector2d difference = (Projection(moved, kThickness)(point) - project(point)) / kStep;
        EXPECT_LT((motion.col(column) - difference).norm(), 1e-5 * std::max(1.0, difference.norm()))
            << "aspect " << aspect << ", motion " << column;
        ++column;
      }
    }
  }
}

TEST(Projection, JacobianAgreesWithDifferences) {
  Camera squeezed = awkwardCamera();
  squeezed.aspect = 0.6;
  for (const Camera& camera : {Camera{}, awkwardCamera(), squeezed}) {
    const Projection project(camera, kThickness);
    for (const Eigen::Vector3d& point : somePoints()) {
      const auto jacobian = project.jacobian(point);
      constexpr double kStep = 1e-6;
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
        const Eigen::Vector2d difference = (project(point + step) - project(point - step)) / (2 * kStep);
        EXPECT_NEAR((jacobian.col(axis) - difference).norm(), 0.0, 1e-6 * jacobian.norm());
      }
    }
  }
}

}  // namespace
