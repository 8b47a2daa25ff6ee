#include "sensor/projection.h"

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace sensor {

namespace {

/// Returns the rotation of a camera that looks along -z; it is its own inverse.
Eigen::DiagonalMatrix<double, 3> nominal() {
  return {1.0, -1.0, -1.0};
}

/// Returns the polynomial of a fisheye, r_d / theta, and its derivative by theta^2.
std::pair<double, double> fisheyeScale(const Camera& camera, double theta2) {
  return {1.0 + (camera.k1 + (camera.k2 + (camera.k3 + camera.k4 * theta2) * theta2) * theta2) * theta2,
          camera.k1 + (2.0 * camera.k2 + (3.0 * camera.k3 + 4.0 * camera.k4 * theta2) * theta2) * theta2};
}

/// Returns where a direction is in the picture, in focal lengths along u from the principal point.
Eigen::Vector2d distorted(const Camera& camera, const Eigen::Vector3d& seen) {
  if (camera.fisheye) {
    const double across = seen.head<2>().norm(), theta = std::atan2(across, seen.z());
    if (across == 0.0) return Eigen::Vector2d::Zero();
    return fisheyeScale(camera, theta * theta).first * theta / across * seen.head<2>();
  }
  const Eigen::Vector2d ideal = seen.head<2>() / seen.z();
  const double r2 = ideal.squaredNorm();
  return (1.0 + (camera.k1 + camera.k2 * r2) * r2) * ideal;
}

/// Returns the derivative of the above by the direction.
Eigen::Matrix<double, 2, 3> distortedBySeen(const Camera& camera, const Eigen::Vector3d& seen) {
  Eigen::Matrix<double, 2, 3> bySeen;
  const double across = seen.head<2>().norm();
  if (camera.fisheye && across > 1e-9 * seen.z()) {  // else a pinhole's, without distortion
    const double theta = std::atan2(across, seen.z()), theta2 = theta * theta;
    const auto [scale, byTheta2] = fisheyeScale(camera, theta2);
    // Around the axis the radius turns, along it theta changes.
    const Eigen::Vector2d outward = seen.head<2>() / across;
    const Eigen::Matrix2d along = outward * outward.transpose();
    const double slope = (scale + 2.0 * byTheta2 * theta2) / seen.squaredNorm();
    bySeen << slope * seen.z() * along + scale * theta / across * (Eigen::Matrix2d::Identity() - along),
        -slope * across * outward;
    return bySeen;
  }
  const Eigen::Vector2d ideal = seen.head<2>() / seen.z();
  bySeen << Eigen::Matrix2d::Identity() / seen.z(), -ideal / seen.z();
  const double r2 = ideal.squaredNorm();
  const double scale = 1.0 + (camera.k1 + camera.k2 * r2) * r2;
  const double scaleByR2 = camera.k1 + 2.0 * camera.k2 * r2;
  return (scale * Eigen::Matrix2d::Identity() + 2.0 * scaleByR2 * ideal * ideal.transpose()) * bySeen;
}

}  // namespace

Eigen::Matrix3d toCamera(const Camera& camera) {
  return Eigen::AngleAxisd(camera.rotation.norm(), camera.rotation.normalized()).toRotationMatrix() * nominal();
}

void setToCamera(Camera& camera, const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turned(Eigen::Matrix3d(rotation * nominal()));
  camera.rotation = turned.angle() * turned.axis();
}

std::optional<double> foldOf(const Camera& camera) {
  if (!camera.fisheye) return std::nullopt;
  const Eigen::Vector2d last_px(camera.width - 1.0, camera.height - 1.0);
  const Eigen::Vector2d farthest_px =
      camera.principal_px.cwiseAbs().cwiseMax((last_px - camera.principal_px).cwiseAbs());
  const double corner = farthest_px.cwiseQuotient(Eigen::Vector2d(1.0, camera.aspect)).norm() / camera.focal_px;
  constexpr double kStep = 1e-3;
  for (double theta = kStep; theta < 0.5 * std::numbers::pi; theta += kStep) {
    const auto [scale, byTheta2] = fisheyeScale(camera, theta * theta);
    if (!(scale + 2.0 * byTheta2 * theta * theta > 0.0)) return theta;
    if (scale * theta >= corner) break;
  }
  return std::nullopt;
}

bool isBehindWindow(const Camera& camera, double gelThickness) {
  if (camera.surfaces.empty()) return camera.position.z() > gelThickness + camera.windowThickness;
  return isBehind(camera.surfaces.back(), camera.position);
}

Projection::Projection(const Camera& camera, double gelThickness)
    : camera_(camera)
    , gelThickness_(gelThickness)
    , focal_px_(camera.focal_px, camera.aspect * camera.focal_px)
    , toCamera_(toCamera(camera)) {}

SightLine Projection::sightLineTo(const Eigen::Vector3d& point) const {
  if (!camera_.surfaces.empty()) return curvedSightLine(camera_.position, camera_.surfaces, camera_.gelIndex, point);
  const std::array<FlatLayer, 3> layers = {{{camera_.gelIndex, gelThickness_ - point.z()},
                                            {camera_.windowIndex, camera_.windowThickness},
                                            {1.0, camera_.position.z() - gelThickness_ - camera_.windowThickness}}};
  return flatSightLine(camera_.position, layers, point);
}

Eigen::Vector2d Projection::operator()(const Eigen::Vector3d& point) const {
  const SightLine line = sightLineTo(point);
  return camera_.principal_px + focal_px_.cwiseProduct(distorted(camera_, toCamera_ * line.direction));
}

Eigen::Matrix<double, 2, 3> Projection::jacobian(const Eigen::Vector3d& point) const {
  const SightLine line = sightLineTo(point);
  return focal_px_.asDiagonal() * distortedBySeen(camera_, toCamera_ * line.direction) * toCamera_ * line.byPoint;
}

Eigen::Matrix<double, 2, 4> Projection::motionOf(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d r = pixel - camera_.principal_px;
  Eigen::Matrix<double, 2, 4> motion;
  motion << 1.0, 0.0, r.x(), -r.y() / camera_.aspect, 0.0, 1.0, r.y(), r.x() * camera_.aspect;
  return motion;
}

}  // namespace sensor
