// The ray from the camera to a point stays in the plane that holds the point and the camera's line along z. Let rho be
// the point's distance from that line and q the tangent of the ray's angle to the z axis in air. Snell's law at planes
// of constant z keeps n sin(angle), so a layer of thickness a and index n is crossed with the lateral step
// a q / sqrt(n^2 + (n^2 - 1) q^2), and the sum of the steps over gel, window and air is rho. With m = q / rho, which
// stays finite on the axis, that is F(m) = m sum(a_i / s_i) - 1 = 0, s_i = sqrt(n_i^2 + (n_i^2 - 1) m^2 rho^2): one
// scalar equation, solved by Newton from the paraxial m = 1 / sum(a_i / n_i), which lies on the side from which the
// iteration is monotone (q -> rho is concave for n >= 1). The camera sees the point in the direction (m dx, m dy, -1);
// the derivatives of m follow from F by implicit differentiation.
#include "sensor/projection.h"

#include <Eigen/Geometry>

#include <array>
#include <cmath>

namespace sensor {

/// The ray from the camera to a point. Its direction in the gel frame is (slope dx, slope dy, -1).
struct Projection::Ray {
  Eigen::Vector2d lateral;  ///< (dx, dy) from the camera's line along z to the point [m]
  double slope;             ///< m [1/m]
  double slopeByRho2;       ///< dm / d(rho^2)
  double slopeByZ;          ///< dm / dz
};

Projection::Projection(const Camera& camera, double gelThickness)
    : camera_(camera)
    , gelThickness_(gelThickness)
    , focal_px_(camera.focal_px, camera.aspect * camera.focal_px) {
  const Eigen::Matrix3d nominal = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  const double angle = camera.rotation.norm();
  toCamera_ = nominal;
  if (angle > 0.0) toCamera_ = Eigen::AngleAxisd(angle, camera.rotation / angle).toRotationMatrix() * nominal;
}

Projection::Ray Projection::rayTo(const Eigen::Vector3d& point) const {
  const Eigen::Vector2d lateral = (point - camera_.position).head<2>();
  const double rho2 = lateral.squaredNorm();
  const std::array<double, 3> index = {camera_.gelIndex, camera_.windowIndex, 1.0};
  const std::array<double, 3> thickness = {gelThickness_ - point.z(), camera_.windowThickness,
                                           camera_.position.z() - gelThickness_ - camera_.windowThickness};
  double reduced = 0.0;
  for (std::size_t i = 0; i < 3; ++i) reduced += thickness[i] / index[i];

  double slope = 1.0 / reduced;
  double bySlope = 0.0, byRho2 = 0.0, byZ = 0.0;
  constexpr int kMostIterations = 20;  // 4 or 5 suffice at 45 degrees
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    double sum = 0.0, sumCubes = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const double bend = index[i] * index[i] - 1.0;
      const double root = std::sqrt(index[i] * index[i] + bend * slope * slope * rho2);
      sum += thickness[i] / root;
      sumCubes += thickness[i] * bend / (root * root * root);
      if (i == 0) byZ = -slope / root;
    }
    bySlope = sum - slope * slope * rho2 * sumCubes;
    byRho2 = -0.5 * slope * slope * slope * sumCubes;
    const double step = (slope * sum - 1.0) / bySlope;
    slope -= step;
    if (std::abs(step) <= 1e-15 * std::abs(slope)) break;
  }
  return {lateral, slope, -byRho2 / bySlope, -byZ / bySlope};
}

Eigen::Vector2d Projection::operator()(const Eigen::Vector3d& point) const {
  const Ray ray = rayTo(point);
  const Eigen::Vector3d seen =
      toCamera_ * Eigen::Vector3d(ray.slope * ray.lateral.x(), ray.slope * ray.lateral.y(), -1.0);
  const Eigen::Vector2d ideal = seen.head<2>() / seen.z();
  const double r2 = ideal.squaredNorm();
  const Eigen::Vector2d distorted = (1.0 + (camera_.k1 + camera_.k2 * r2) * r2) * ideal;
  return camera_.principal_px + focal_px_.cwiseProduct(distorted);
}

Eigen::Matrix<double, 2, 3> Projection::jacobian(const Eigen::Vector3d& point) const {
  const Ray ray = rayTo(point);
  const Eigen::Vector3d seen =
      toCamera_ * Eigen::Vector3d(ray.slope * ray.lateral.x(), ray.slope * ray.lateral.y(), -1.0);
  const Eigen::Vector2d ideal = seen.head<2>() / seen.z();
  const double r2 = ideal.squaredNorm();

  Eigen::Matrix3d directionByPoint = Eigen::Matrix3d::Zero();
  directionByPoint.topLeftCorner<2, 2>() =
      ray.slope * Eigen::Matrix2d::Identity() + 2.0 * ray.slopeByRho2 * ray.lateral * ray.lateral.transpose();
  directionByPoint.topRightCorner<2, 1>() = ray.slopeByZ * ray.lateral;

  Eigen::Matrix<double, 2, 3> idealBySeen;
  idealBySeen << Eigen::Matrix2d::Identity() / seen.z(), -ideal / seen.z();

  const double scale = 1.0 + (camera_.k1 + camera_.k2 * r2) * r2;
  const double scaleByR2 = camera_.k1 + 2.0 * camera_.k2 * r2;
  const Eigen::Matrix2d pixelByIdeal =
      focal_px_.asDiagonal() *
      (scale * Eigen::Matrix2d::Identity() + 2.0 * scaleByR2 * ideal * ideal.transpose()).eval();

  return pixelByIdeal * idealBySeen * toCamera_ * directionByPoint;
}

Eigen::Matrix<double, 2, 4> Projection::motionOf(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d r = pixel - camera_.principal_px;
  Eigen::Matrix<double, 2, 4> motion;
  motion << 1.0, 0.0, r.x(), -r.y() / camera_.aspect, 0.0, 1.0, r.y(), r.x() * camera_.aspect;
  return motion;
}

}  // namespace sensor
