// Points lie on rings at equal angles. The mean over a circle of a field that is smooth below the surface is a smooth
// function of r^2, so Gauss points in r^2 suit the constant density. Hertz's density is proportional to s = sqrt(1 -
// r^2 / a^2) and r dr to s ds, so the integrand is s^2 times an even function of s. The positive points of a Gauss rule
// on [-1, 1] with an odd number of points suit it; its point zero has no weight. Both converge exponentially.
#include "sensor/elastic/loads.h"

#include "sensor/elastic/quadrature.h"

#include <cmath>
#include <numbers>
#include <utility>

namespace sensor::elastic {
namespace {

enum class Density { kHertz, kConstant };

// Points of a unit density; the weights add up to one.
struct Weighted {
  Points points;
  Eigen::VectorXd weights;
};

Weighted polar(const Eigen::Vector2d& centre, double radius, int rings, Density density) {
  constexpr int kFewest = 2;
  constexpr double kRingSpacing = 2.5e-3;  // [m]
  if (rings == 0) rings = kFewest + static_cast<int>(std::lround(radius / kRingSpacing));
  const int angles = 4 * rings;
  const bool isHertz = density == Density::kHertz;
  const Rule rule = gauss(isHertz ? 2 * rings + 1 : rings);
  Weighted result{Points::Zero(3, rings * angles), Eigen::VectorXd(rings * angles)};
  for (int ring = 0; ring < rings; ++ring) {
    const int index = isHertz ? rings + 1 + ring : ring;
    const double t = rule.points[index];
    const double r = radius * std::sqrt(isHertz ? 1.0 - t * t : 0.5 * (1.0 + t));
    const double weight = rule.weights[index] * (isHertz ? 3.0 * t * t : 0.5) / angles;
    for (int k = 0; k < angles; ++k) {
      const double angle = 2.0 * std::numbers::pi * (k + 0.5 * (ring % 2)) / angles;
      const int point = ring * angles + k;
      result.points.col(point).head<2>() = centre + r * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      result.weights[point] = weight;
    }
  }
  return result;
}

PatchQuadrature along(Weighted patch, const Eigen::Vector3d& force) {
  return {std::move(patch.points), force * (patch.weights / patch.weights.sum()).transpose()};
}

}  // namespace

PatchQuadrature hertz(const Eigen::Vector2d& centre, double radius, const Eigen::Vector3d& force, int rings) {
  return along(polar(centre, radius, rings, Density::kHertz), force);
}

PatchQuadrature disc(const Eigen::Vector2d& centre, double radius, const Eigen::Vector3d& force, int rings) {
  return along(polar(centre, radius, rings, Density::kConstant), force);
}

PatchQuadrature twist(const Eigen::Vector2d& centre, double radius, double torque, int rings) {
  Weighted patch = polar(centre, radius, rings, Density::kHertz);
  Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, patch.points.cols());
  double turning = 0.0;  // torque of the forces before scaling, per unit [m^2]
  for (int i = 0; i < forces.cols(); ++i) {
    const Eigen::Vector2d arm = patch.points.col(i).head<2>() - centre;
    forces.col(i).head<2>() = patch.weights[i] * Eigen::Vector2d(-arm.y(), arm.x());
    turning += patch.weights[i] * arm.squaredNorm();
  }
  return {std::move(patch.points), forces * (torque / turning)};
}

}  // namespace sensor::elastic
