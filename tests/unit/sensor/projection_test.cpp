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

/// A camera in a hollow bone, above or within its ellipsoids, or above a clear one with a flat end; turned and
/// distorted.
std::vector<Camera> camerasBehindCurvedWindows() {
  Camera camera = awkwardCamera();
  camera.position = {1e-3, -0.7e-3, 12e-3};
  camera.surfaces = {{.centre = {0, 0, 10e-3}, .radii = {6e-3, 6e-3, 6e-3}, .index = 1.5},
                     {.centre = {0.2e-3, 0, 10e-3}, .radii = {4e-3, 4.2e-3, 4.6e-3}, .index = 1.0}};
  Camera above = camera;
  above.position.z() = 45e-3;
  Camera solid = above;
  solid.surfaces.back() = {.centre = {0, 0, 18e-3}};
  return {camera, above, solid};
}

std::vector<Eigen::Vector3d> pointsInFingertip() {
  return {{0, 0, 2e-3}, {1e-3, 2e-3, 2.3e-3}, {-2e-3, -1.5e-3, 2.5e-3}, {2.7e-3, -1e-3, 2.6e-3}};
}

/// Fermat's principle, independent of Snell's law and of shooting rays: returns the direction (z = -1) in which the
/// light leaves that takes the least optical path from the camera to the point.
Eigen::Vector3d quickest(const Camera& camera, const Eigen::Vector3d& point) {
  const auto path = [&](const Eigen::Vector4d& crossings, Eigen::Vector3d* first) {
    Eigen::Vector3d from = point;
    double length = 0.0, index = camera.gelIndex;
    for (std::size_t i = 0; i < 2; ++i) {
      const sensor::RefractingSurface& surface = camera.surfaces[i];
      Eigen::Vector3d at(crossings[2 * i], crossings[2 * i + 1], surface.centre.z());
      if (surface.radii.x() > 0.0) {
        const Eigen::Vector2d r = (at - surface.centre).head<2>().cwiseQuotient(surface.radii.head<2>());
        at.z() -= surface.radii.z() * std::sqrt(1.0 - r.squaredNorm());
      }
      length += index * (at - from).norm();
      from = at;
      index = surface.index;
    }
    if (first) *first = from;
    return length + (camera.position - from).norm();
  };
  Eigen::Vector4d x;
  for (int i = 0; i < 2; ++i) {  // from where the straight line crosses the surface's lowest plane
    const double z = camera.surfaces[i].centre.z() - camera.surfaces[i].radii.z();
    x.segment<2>(2 * i) =
        (point + (camera.position - point) * (z - point.z()) / (camera.position.z() - point.z())).head<2>();
  }
  constexpr double kStep = 2e-6;
  for (int iteration = 0; iteration < 20; ++iteration) {
    Eigen::Vector4d gradient;
    Eigen::Matrix4d hessian;
    const auto at = [&](int i, double byI, int j, double byJ) {
      Eigen::Vector4d moved = x;
      moved[i] += byI * kStep;
      moved[j] += byJ * kStep;
      return path(moved, nullptr);
    };
    for (int i = 0; i < 4; ++i) {
      gradient[i] = (at(i, 1, i, 0) - at(i, -1, i, 0)) / (2 * kStep);
      for (int j = 0; j < 4; ++j) {
        hessian(i, j) = (at(i, 1, j, 1) - at(i, 1, j, -1) - at(i, -1, j, 1) + at(i, -1, j, -1)) / (4 * kStep * kStep);
      }
    }
    x -= hessian.ldlt().solve(gradient);
  }
  Eigen::Vector3d last;
  path(x, &last);
  return (last - camera.position) / (camera.position.z() - last.z());
}

TEST(Projection, LightThroughCurvedWindowsTakesTheQuickestWay) {
  for (Camera camera : camerasBehindCurvedWindows()) {
    camera.focal_px = camera.aspect = 1.0;  // a picture that shows the direction
    camera.principal_px.setZero();
    camera.rotation.setZero();
    camera.k1 = camera.k2 = 0.0;
    const Projection project(camera, kThickness);
    for (const Eigen::Vector3d& point : pointsInFingertip()) {
      const Eigen::Vector3d expected = quickest(camera, point);
      const Eigen::Vector2d straight = (point - camera.position).head<2>() / (camera.position.z() - point.z());
      EXPECT_NEAR((project(point) - Eigen::Vector2d(expected.x(), -expected.y())).norm(), 0.0, 1e-6);
      EXPECT_GT((expected.head<2>() - straight).norm(), 5e-4) << "no refraction to speak of";
    }
  }
}

TEST(Projection, PlanesAreTheFlatWindow) {
  const Camera flat = awkwardCamera();
  Camera planes = flat;
  planes.surfaces = {{.centre = {0, 0, kThickness}, .index = flat.windowIndex},
                     {.centre = {0, 0, kThickness + flat.windowThickness}}};
  for (const Eigen::Vector3d& point : somePoints()) {
    EXPECT_NEAR((Projection(planes, kThickness)(point) - Projection(flat, kThickness)(point)).norm(), 0.0, 1e-9);
  }
}

TEST(Projection, WhatCurvedWindowsHideIsNoNumber) {
  const Camera camera = camerasBehindCurvedWindows().front();
  const Projection project(camera, kThickness);
  EXPECT_FALSE(project({0, 0, 5e-3}).allFinite()) << "in the bone";
  EXPECT_FALSE(project({9e-3, 0, 11e-3}).allFinite()) << "above the half that is towards lower z";
  EXPECT_FALSE(project({0, 0, 20e-3}).allFinite()) << "behind the camera";
}

/// A fisheye that sees 160 degrees through the window.
Camera fisheyeCamera() {
  Camera camera = awkwardCamera();
  camera.fisheye = true;
  camera.focal_px = 230.0;
  camera.aspect = 1.1;
  camera.position = {4e-3, -3e-3, 52e-3};
  camera.k1 = 0.04;
  camera.k2 = -0.02;
  camera.k3 = 0.005;
  camera.k4 = -0.001;
  return camera;
}

TEST(Projection, FisheyeLooksAlongItsAxisLikeAPinhole) {
  Camera fisheye = fisheyeCamera();
  fisheye.rotation.setZero();
  Camera pinhole = fisheye;
  pinhole.fisheye = false;
  const Eigen::Vector3d onAxis(fisheye.position.x(), fisheye.position.y(), 7e-3);
  const Projection project(fisheye, kThickness), plain(pinhole, kThickness);
  EXPECT_EQ(project(onAxis), fisheye.principal_px);
  EXPECT_LT((project.jacobian(onAxis) - plain.jacobian(onAxis)).norm(), 1e-9 * plain.jacobian(onAxis).norm());
}

/// r_d = theta - theta^3 / 3 stops to rise at 1 rad, where it is 2/3.
TEST(Projection, FoldOfAFisheyeIsFoundInThePictureAlone) {
  Camera camera;
  camera.fisheye = true;
  camera.k1 = -1.0 / 3.0;
  const double corner_px = camera.principal_px.norm();
  camera.focal_px = 1.51 * corner_px;
  EXPECT_FALSE(sensor::foldOf(camera));
  camera.focal_px = 1.49 * corner_px;
  ASSERT_TRUE(sensor::foldOf(camera));
  EXPECT_NEAR(*sensor::foldOf(camera), 1.0, 2e-3);
  camera.fisheye = false;
  EXPECT_FALSE(sensor::foldOf(camera));
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
  std::vector<Camera> cameras = camerasBehindCurvedWindows();
  const std::size_t curved = cameras.size();
  cameras.insert(cameras.end(), {Camera{}, awkwardCamera(), squeezed, fisheyeCamera()});
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Projection project(cameras[i], kThickness);
    for (const Eigen::Vector3d& point : i < curved ? pointsInFingertip() : somePoints()) {
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
