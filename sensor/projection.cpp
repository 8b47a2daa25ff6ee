#include "sensor/projection.h"

#include <Eigen/Geometry>

#include <array>

namespace sensor {

namespace {

/// Returns the rotation of a camera that looks along -z; it is its own inverse.
Eigen::DiagonalMatrix<double, 3> nominal() {
  return {1.0, -1.0, -1.0};
}

}  // namespace

Eigen::Matrix3d toCamera(const Camera& camera) {
  return Eigen::AngleAxisd(camera.rotation.norm(), camera.rotation.normalized()).toRotationMatrix() * nominal();
}

void setToCamera(Camera& camera, const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turned(Eigen::Matrix3d(rotation * nominal()));
  camera.rotation = turned.angle() * turned.axis();
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
  const Eigen::Vector3d seen = toCamera_ * line.direction;
  const Eigen::Vector2d ideal = seen.head<2>() / seen.z();
  const double r2 = ideal.squaredNorm();
  const Eigen::Vector2d distorted = (1.0 + (camera_.k1 + camera_.k2 * r2) * r2) * ideal;
  return camera_.principal_px + focal_px_.cwiseProduct(distorted);
}

Eigen::Matrix<double, 2, 3> Projection::jacobian(const Eigen::Vector3d& point) const {
  const SightLine line = sightLineTo(point);
  const Eigen::Vector3d seen = toCamera_ * line.direction;
  const Eigen::Vector2d ideal = seen.head<2>() / seen.z();
  const double r2 = ideal.squaredNorm();

  Eigen::Matrix<double, 2, 3> idealBySeen;
  idealBySeen << Eigen::Matrix2d::Identity() / seen.z(), -ideal / seen.z();

  const double scale = 1.0 + (camera_.k1 + camera_.k2 * r2) * r2;
  const double scaleByR2 = camera_.k1 + 2.0 * camera_.k2 * r2;
  const Eigen::Matrix2d pixelByIdeal =
      focal_px_.asDiagonal() *
      (scale * Eigen::Matrix2d::Identity() + 2.0 * scaleByR2 * ideal * ideal.transpose()).eval();

  return pixelByIdeal * idealBySeen * toCamera_ * line.byPoint;
}

Eigen::Matrix<double, 2, 4> Projection::motionOf(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d r = pixel - camera_.principal_px;
  Eigen::Matrix<double, 2, 4> motion;
  motion << 1.0, 0.0, r.x(), -r.y() / camera_.aspect, 0.0, 1.0, r.y(), r.x() * camera_.aspect;
  return motion;
}

}  // namespace sensor
