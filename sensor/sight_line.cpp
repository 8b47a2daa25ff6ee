#include "sensor/sight_line.h"

#include <Eigen/LU>
#include <unsupported/Eigen/AutoDiff>

#include <cmath>
#include <limits>
#include <optional>

namespace sensor {

// The ray from the camera to a point stays in the plane that holds the point and the camera's line along z. Let rho be
// the point's distance from that line and q the tangent of the ray's angle to the z axis in air. Snell's law at planes
// of constant z keeps n sin(angle), so a layer of thickness a and index n is crossed with the lateral step
// a q / sqrt(n^2 + (n^2 - 1) q^2), and the sum of the steps over gel, window and air is rho. With m = q / rho, which
// stays finite on the axis, that is F(m) = m sum(a_i / s_i) - 1 = 0, s_i = sqrt(n_i^2 + (n_i^2 - 1) m^2 rho^2): one
// scalar equation, solved by Newton from the paraxial m = 1 / sum(a_i / n_i), which lies on the side from which the
// iteration is monotone (q -> rho is concave for n >= 1). The camera sees the point in the direction (m dx, m dy, -1);
// the derivatives of m follow from F by implicit differentiation.
SightLine flatSightLine(const Eigen::Vector3d& eye, const std::array<FlatLayer, 3>& layers,
                        const Eigen::Vector3d& point) {
  const Eigen::Vector2d lateral = (point - eye).head<2>();
  const double rho2 = lateral.squaredNorm();
  double reduced = 0.0;
  for (const FlatLayer& layer : layers) reduced += layer.thickness / layer.index;

  double slope = 1.0 / reduced;
  double bySlope = 0.0, byRho2 = 0.0, byZ = 0.0;
  constexpr int kMostIterations = 20;  // 4 or 5 suffice at 45 degrees
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    double sum = 0.0, sumCubes = 0.0;
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const auto& [index, thickness] = layers[i];
      const double bend = index * index - 1.0;
      const double root = std::sqrt(index * index + bend * slope * slope * rho2);
      sum += thickness / root;
      sumCubes += thickness * bend / (root * root * root);
      if (i == 0) byZ = -slope / root;
    }
    bySlope = sum - slope * slope * rho2 * sumCubes;
    byRho2 = -0.5 * slope * slope * slope * sumCubes;
    const double step = (slope * sum - 1.0) / bySlope;
    slope -= step;
    if (std::abs(step) <= 1e-15 * std::abs(slope)) break;
  }
  SightLine line{.direction = {slope * lateral.x(), slope * lateral.y(), -1.0}, .byPoint = Eigen::Matrix3d::Zero()};
  line.byPoint.topLeftCorner<2, 2>() =
      slope * Eigen::Matrix2d::Identity() - 2.0 * byRho2 / bySlope * lateral * lateral.transpose();
  line.byPoint.topRightCorner<2, 1>() = -byZ / bySlope * lateral;
  return line;
}

bool isBehind(const RefractingSurface& surface, const Eigen::Vector3d& point) {
  const Eigen::Vector3d from = point - surface.centre;
  if (surface.isPlane() || from.z() >= 0.0) return from.z() > 0.0;
  return from.cwiseQuotient(surface.radii).squaredNorm() < 1.0;
}

namespace {

using Slopes = Eigen::AutoDiffScalar<Eigen::Vector2d>;  // a number and its derivatives by x and y of the direction
using Vector = Eigen::Matrix<Slopes, 3, 1>;

struct Ray {
  Vector place, direction;  // of length 1
};

Slopes dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void advance(Ray& ray, const Slopes& way) {
  for (int k = 0; k < 3; ++k) ray.place[k] += way * ray.direction[k];
}

/// Takes a ray through a surface, out of the material `from` into `to`. Returns false if it misses the surface, or is
/// reflected.
bool cross(Ray& ray, const RefractingSurface& surface, double from, double to) {
  Vector normal;  // along the ray
  if (surface.isPlane()) {
    normal << Slopes(0.0), Slopes(0.0), Slopes(-1.0);
    advance(ray, (surface.centre.z() - ray.place[2]) / ray.direction[2]);
  } else {
    // Where |(place + way direction - centre) / radii| = 1 for the second time.
    Vector start, step;
    for (int k = 0; k < 3; ++k) {
      start[k] = (ray.place[k] - surface.centre[k]) / surface.radii[k];
      step[k] = ray.direction[k] / surface.radii[k];
    }
    const Slopes square = dot(step, step), half = dot(start, step);
    const Slopes root = half * half - square * (dot(start, start) - 1.0);
    if (!(root.value() > 0.0)) return false;
    advance(ray, (sqrt(root) - half) / square);
    if (ray.place[2].value() > surface.centre.z()) return false;
    for (int k = 0; k < 3; ++k) {
      normal[k] = (ray.place[k] - surface.centre[k]) / (surface.radii[k] * surface.radii[k]);
    }
    const Slopes length = sqrt(dot(normal, normal));
    for (int k = 0; k < 3; ++k) normal[k] = normal[k] / length;
  }
  // Snell's law for vectors.
  const double ratio = from / to;
  const Slopes cosine = dot(normal, ray.direction);
  const Slopes root = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
  if (!(root.value() > 0.0)) return false;
  const Slopes bend = sqrt(root) - ratio * cosine;
  for (int k = 0; k < 3; ++k) ray.direction[k] = ratio * ray.direction[k] + bend * normal[k];
  return true;
}

/// Where the ray in a direction crosses the point's plane of constant z, beside the point.
struct Miss {
  Eigen::Vector2d offset;       // [m]
  Eigen::Matrix2d byDirection;  // d(offset) / d(direction x, y) [m]
  Eigen::Vector2d byZ;          // d(offset) / d(point z)
};

std::optional<Miss> trace(const Eigen::Vector3d& eye, const Eigen::Vector2d& direction,
                          const std::vector<RefractingSurface>& surfaces, double gelIndex,
                          const Eigen::Vector3d& point) {
  Ray ray;
  ray.place << Slopes(eye.x()), Slopes(eye.y()), Slopes(eye.z());
  const Slopes x(direction.x(), 2, 0), y(direction.y(), 2, 1);
  const Slopes length = sqrt(x * x + y * y + 1.0);
  ray.direction << x / length, y / length, -1.0 / length;
  for (std::size_t i = surfaces.size(); i-- > 0;) {
    if (!cross(ray, surfaces[i], surfaces[i].index, i == 0 ? gelIndex : surfaces[i - 1].index)) return std::nullopt;
  }
  const Slopes way = (point.z() - ray.place[2]) / ray.direction[2];
  if (!(ray.direction[2].value() < 0.0) || !(way.value() > 0.0)) return std::nullopt;
  Miss miss;
  for (int k = 0; k < 2; ++k) {
    const Slopes offset = ray.place[k] + way * ray.direction[k] - point[k];
    miss.offset[k] = offset.value();
    miss.byDirection.row(k) = offset.derivatives().transpose();
    miss.byZ[k] = ray.direction[k].value() / ray.direction[2].value();
  }
  return miss;
}

}  // namespace

// Newton for the direction whose refracted ray passes through the point, from the straight line. A step that leaves the
// surfaces, or does not come nearer, is halved.
SightLine curvedSightLine(const Eigen::Vector3d& eye, const std::vector<RefractingSurface>& surfaces, double gelIndex,
                          const Eigen::Vector3d& point) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  SightLine hidden{.direction = Eigen::Vector3d::Constant(kNan), .byPoint = Eigen::Matrix3d::Constant(kNan)};
  if (!(eye.z() > point.z())) return hidden;
  Eigen::Vector2d direction = (point - eye).head<2>() / (eye.z() - point.z());
  std::optional<Miss> miss = trace(eye, direction, surfaces, gelIndex, point);
  if (!miss) return hidden;
  constexpr double kEnough = 1e-13;  // [m]
  constexpr int kMostIterations = 50, kMostHalvings = 20;
  for (int iteration = 0; iteration < kMostIterations && miss->offset.norm() > kEnough; ++iteration) {
    Eigen::Vector2d step = -miss->byDirection.inverse() * miss->offset;
    std::optional<Miss> next;
    for (int halving = 0; halving < kMostHalvings; ++halving, step *= 0.5) {
      next = trace(eye, direction + step, surfaces, gelIndex, point);
      if (next && next->offset.norm() < miss->offset.norm()) break;
      next.reset();
    }
    if (!next) break;
    direction += step;
    miss = next;
  }
  if (!(miss->offset.norm() < 1e-9)) return hidden;
  const Eigen::Matrix2d inverse = miss->byDirection.inverse();
  SightLine line{.direction = {direction.x(), direction.y(), -1.0}, .byPoint = Eigen::Matrix3d::Zero()};
  line.byPoint.topLeftCorner<2, 2>() = inverse;
  line.byPoint.topRightCorner<2, 1>() = -inverse * miss->byZ;
  return line;
}

}  // namespace sensor
