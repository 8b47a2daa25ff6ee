// The unknowns are the camera's eleven numbers, and for each layer its depth, pitch and (but the first, which defines
// the frame) its place. All are scaled to about one pixel's effect so that one step serves all central differences.
#include "daemon/calibrate/geometry_fit.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::calibrate {

namespace {

constexpr int kCamera = 11;        // focal, principal 2, position 3, rotation 3, k1, k2
constexpr int kOfLayer = 4;        // depth, pitch, x, y
constexpr int kFewest = 50;        // markers: below, the fit says nothing of the lens
constexpr double kStep = 1e-3;     // of the scaled unknowns, for differences
constexpr double kSettled = 1e-2;  // deviations that a step moves the unknowns by
constexpr int kRounds = 4;
constexpr double kScatterFloor_px = 1e-4;  // of exact data

/// What one unit of each unknown of the camera means: about a pixel at the picture's edge.
Eigen::Matrix<double, kCamera, 1> cameraUnits() {
  Eigen::Matrix<double, kCamera, 1> units;
  units << 4e-3, 1.0, 1.0, 0.15e-3, 0.15e-3, 0.6e-3, 1e-3, 1e-3, 4e-3, 0.07, 1.0;
  return units;
}

class Problem {
 public:
  Problem(const sensor::Sensor& start, const GeometryOptions& options)
      : start_(start)
      , unknowns_(kCamera + kOfLayer * static_cast<int>(start.layers.size()))
      , deviation_(Eigen::VectorXd::Constant(unknowns_, std::numeric_limits<double>::infinity())) {
    const auto units = cameraUnits();
    deviation_[0] = start.uncertainty.focal / units[0];
    deviation_.segment<2>(1).setConstant(options.principal_px);
    for (std::size_t i = 0; i < start.layers.size(); ++i) {
      auto ofLayer = deviation_.segment<kOfLayer>(kCamera + kOfLayer * static_cast<int>(i));
      ofLayer << options.depth, options.pitch, options.shift, options.shift;
      if (i == 0) ofLayer.tail<2>().setZero();
    }
  }

  int unknowns() const { return unknowns_; }
  double deviation(int unknown) const { return deviation_[unknown]; }
  /// Zero: not an unknown after all.
  bool isFixed(int unknown) const { return deviation_[unknown] == 0.0; }

  sensor::Camera camera(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd change = x.head<kCamera>().cwiseProduct(cameraUnits());
    sensor::Camera camera = start_.camera;
    camera.focal_px *= 1.0 + change[0];
    camera.principal_px += change.segment<2>(1);
    camera.position += change.segment<3>(3);
    camera.rotation += change.segment<3>(6);
    camera.k1 += change[9];
    camera.k2 += change[10];
    return camera;
  }

  /// False: no camera can be there.
  bool project(const Eigen::VectorXd& x, Eigen::VectorXd& pixels) const {
    const sensor::Camera seen = camera(x);
    if (!(seen.focal_px > 0.0) || !(seen.position.z() > start_.gel.size.z() + seen.windowThickness)) return false;
    const sensor::Projection projection(seen, start_.gel.size.z());
    Eigen::Index next = 0;
    for (std::size_t i = 0; i < start_.layers.size(); ++i) {
      const sensor::MarkerLayer& layer = start_.layers[i];
      // In units of the tolerances, which may be zero: then nothing moves.
      const Eigen::Vector4d error = x.segment<kOfLayer>(kCamera + kOfLayer * static_cast<int>(i));
      for (int row = 0; row < layer.rows; ++row) {
        for (int column = 0; column < layer.columns; ++column) {
          Eigen::Vector3d point = layer.position(column, row);
          point.head<2>() += error[1] * (point.head<2>() - layer.centre) + error.tail<2>();
          point.z() += error[0];
          pixels.segment<2>(next) = projection(point);
          next += 2;
        }
      }
    }
    return pixels.allFinite();
  }

  double step(int unknown) const { return unknown < kCamera ? kStep : kStep * deviation_[unknown]; }

 private:
  const sensor::Sensor& start_;
  int unknowns_;
  Eigen::VectorXd deviation_;
};

}  // namespace

Geometry fitGeometry(const sensor::Sensor& start, std::span<const float> seen_px, std::span<const std::uint8_t> present,
                     const GeometryOptions& options) {
  const Problem problem(start, options);
  const auto markers = static_cast<Eigen::Index>(present.size());
  const int n = problem.unknowns();
  Geometry result;
  result.camera = start.camera;
  result.uncertainty = start.uncertainty;

  Eigen::VectorXd x = Eigen::VectorXd::Zero(n), modelled(2 * markers), residual(2 * markers);
  std::vector<std::uint8_t> counts(present.begin(), present.end());
  const auto look = [&](const Eigen::VectorXd& at) {
    if (!problem.project(at, modelled)) return false;
    for (Eigen::Index i = 0; i < 2 * markers; ++i) residual[i] = counts[i / 2] ? seen_px[i] - modelled[i] : 0.0;
    return true;
  };
  result.markers = static_cast<int>(std::ranges::count(counts, 1));
  if (result.markers < kFewest) return result;
  result.outcome = Geometry::Outcome::kDiverged;
  if (!look(x)) return result;

  Eigen::MatrixXd jacobian(2 * markers, n), covariance;
  double scatter = 1.0;
  int rounds = 0;
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    Eigen::VectorXd after(2 * markers), before(2 * markers);
    for (int k = 0; k < n; ++k) {
      if (problem.isFixed(k)) {
        jacobian.col(k).setZero();
        continue;
      }
      Eigen::VectorXd moved = x;
      moved[k] += problem.step(k);
      if (!problem.project(moved, after)) return result;
      moved[k] -= 2 * problem.step(k);
      if (!problem.project(moved, before)) return result;
      jacobian.col(k) = (after - before) / (2 * problem.step(k));
    }
    for (Eigen::Index i = 0; i < markers; ++i) {
      if (!counts[i]) jacobian.middleRows<2>(2 * i).setZero();
    }
    scatter = std::max(std::sqrt(residual.squaredNorm() / (2 * result.markers - kCamera)), kScatterFloor_px);
    Eigen::MatrixXd normal = jacobian.transpose() * jacobian / (scatter * scatter);
    Eigen::VectorXd right = jacobian.transpose() * residual / (scatter * scatter);
    for (int k = 0; k < n; ++k) {
      if (problem.isFixed(k)) {
        normal(k, k) = 1.0;
      } else if (std::isfinite(problem.deviation(k))) {
        const double weight = 1.0 / (problem.deviation(k) * problem.deviation(k));
        normal(k, k) += weight;
        right[k] -= weight * x[k];
      }
    }
    // Scaled to a unit diagonal: the unknowns' information differs by many decades.
    const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Eigen::MatrixXd> factor(scale.asDiagonal() * normal * scale.asDiagonal());
    const Eigen::VectorXd change = scale.cwiseProduct(factor.solve(scale.cwiseProduct(right)));
    if (factor.info() != Eigen::Success || !change.allFinite() || !look(x + change)) return result;
    x += change;
    covariance = scale.asDiagonal() * factor.solve(Eigen::MatrixXd::Identity(n, n)) * scale.asDiagonal();

    if (std::sqrt(change.dot(normal * change)) > kSettled) continue;
    // Markers that are not where the others say do not count; then again without them, a few times at most: where a
    // touch displaces many, they are too many to be sorted out.
    bool dropped = false;
    const double limit = options.outlier * std::sqrt(residual.squaredNorm() / (2 * result.markers)) + kScatterFloor_px;
    for (Eigen::Index i = 0; i < markers; ++i) {
      if (!counts[i] || residual.segment<2>(2 * i).norm() <= limit) continue;
      counts[i] = 0;
      ++result.outliers;
      --result.markers;
      dropped = true;
    }
    if (result.markers < kFewest) return result;
    look(x);
    if (!dropped || ++rounds == kRounds) {
      result.outcome = Geometry::Outcome::kConverged;
      break;
    }
  }
  if (result.outcome != Geometry::Outcome::kConverged) return result;

  const auto units = cameraUnits();
  const Eigen::VectorXd deviation = covariance.diagonal().head<kCamera>().cwiseSqrt().cwiseProduct(units);
  result.camera = problem.camera(x);
  result.uncertainty.focal = deviation[0];
  result.uncertainty.position = deviation.segment<3>(3);
  result.uncertainty.rotation = deviation.segment<3>(6);
  result.uncertainty.focalDistance = covariance(0, 5) / std::sqrt(covariance(0, 0) * covariance(5, 5));
  result.k1Deviation = deviation[9];
  result.k2Deviation = deviation[10];
  result.principalDeviation_px = deviation.segment<2>(1).maxCoeff();
  result.residual_px = std::sqrt(residual.squaredNorm() / (2 * result.markers));
  // All markers that are there: a sharp touch displaces few, and those so far that they do not count.
  std::vector<float> remains(seen_px.begin(), seen_px.end());
  for (Eigen::Index i = 0; i < 2 * markers; ++i) remains[i] -= static_cast<float>(modelled[i]);
  result.bulge = largestBulge(start, {remains, present}, options.allowance_px);
  return result;
}

}  // namespace tractiond::calibrate
