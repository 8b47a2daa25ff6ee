// Tries places around that of the largest displacement as start values, and makes a few Gauss-Newton steps from the
// best one. The half-space part of a contact's field is summed over a quadrature of Hertz's pressure; the correction
// for the block, which varies over lengths of the block, over four points with the same second moments as the pressure.
#include "daemon/calibrate/contact_fit.h"

#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::calibrate {

namespace {

constexpr double kLeastRadius = 0.5e-3, kLargestRadius = 15e-3;  // [m]
constexpr double kFirstRadius = 3e-3;
constexpr double kFirstPitch = 4e-3;  // distance of the places that are tried [m]
constexpr int kFirstReach = 2;    // places to each side: the largest displacement is up to 8 mm away from the centre
constexpr double kMargin = 1e-3;  // between a contact and the sides of the gel [m]
constexpr int kIterations = 20;
constexpr double kStep_m = 1e-5;  // step of place and radius for finite differences
constexpr double kSettled_m = 1e-8;
constexpr int kLinear = 7;  // linear unknowns: force, picture motion

/// Sums over the valid coordinates: weight row^T row, and weight row^T value.
struct Normal {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd right;
};

}  // namespace

ContactFit::ContactFit(const sensor::Sensor& sensor, const sensor::elastic::Progress& progress)
    : sensor_(sensor)
    , markers_(sensor::markerPositions(sensor))
    , correction_(sensor.gel, markers_, {}, progress) {}

Eigen::MatrixXd ContactFit::unitFields(const sensor::Projection& projection, const Eigen::Vector3d& shape, bool roughly,
                                       double deeper) const {
  const Eigen::Vector2d place = shape.head<2>();
  const double radius = shape.z();
  const auto patch = sensor::elastic::hertz(place, radius, Eigen::Vector3d::UnitZ());
  const double arm = radius * std::sqrt(0.4);
  sensor::Points corners = sensor::Points::Zero(3, roughly ? 1 : 4);
  corners.topRows<2>().colwise() = place;
  if (!roughly) corners.topRows<2>() += arm * (Eigen::Matrix<double, 2, 4>() << 1, -1, 0, 0, 0, 0, 1, -1).finished();
  const Eigen::MatrixXd corrections = correction_.matrix(corners);
  const double share = 1.0 / static_cast<double>(corners.cols());
  Eigen::MatrixXd fields(2 * markers_.cols(), 3);
  for (Eigen::Index m = 0; m < markers_.cols(); ++m) {
    Eigen::Matrix3d u = Eigen::Matrix3d::Zero();
    for (Eigen::Index i = 0; i < patch.points.cols(); ++i) {
      u += patch.forces(2, i) * sensor::elastic::halfSpaceDisplacement(
                                    markers_.col(m) + deeper * Eigen::Vector3d::UnitZ() - patch.points.col(i),
                                    sensor_.gel.youngsModulus, sensor_.gel.poissonRatio);
    }
    for (Eigen::Index i = 0; i < corners.cols(); ++i) u += share * corrections.block<3, 3>(3 * m, 3 * i);
    fields.middleRows<2>(2 * m) = projection.jacobian(markers_.col(m)) * u;
  }
  return fields;
}

std::optional<ContactReading> ContactFit::operator()(const sensor::Camera& camera, const sensor::PictureMotion& motion,
                                                     const Displacements& displacements,
                                                     std::span<const float> variance_px2) const {
  sensor::Sensor seen = sensor_;
  seen.camera = camera;
  const sensor::Projection projection(camera, sensor_.gel.size.z());
  const PictureMotionFit motionFit(seen);
  std::vector<std::uint8_t> counts(displacements.valid.begin(), displacements.valid.end());
  for (std::size_t m = 0; m < counts.size(); ++m) counts[m] = counts[m] != 0 && variance_px2[m] > 0.0F ? 1 : 0;
  const auto whole = motionFit({displacements.value_px, counts});
  if (!whole) return std::nullopt;

  const Eigen::Index rows = 2 * markers_.cols();
  Eigen::VectorXd value(rows), weight(rows);
  Eigen::MatrixXd motions(rows, 4);
  std::vector<float> deformation(displacements.value_px.begin(), displacements.value_px.end());
  int coordinates = 0;
  for (Eigen::Index m = 0; m < markers_.cols(); ++m) {
    const bool valid = counts[m] != 0;
    for (int k = 0; k < 4; ++k) {
      motions.col(k).segment<2>(2 * m) = motionFit.at(static_cast<int>(m), Eigen::Vector4d::Unit(k));
    }
    const Eigen::Vector2d common = motionFit.at(static_cast<int>(m), whole->value);
    for (int c = 0; c < 2; ++c) {
      const Eigen::Index i = 2 * m + c;
      value[i] = valid ? static_cast<double>(displacements.value_px[i]) : 0.0;
      weight[i] = valid ? 1.0 / static_cast<double>(variance_px2[m]) : 0.0;
      deformation[i] -= static_cast<float>(common[c]);
      coordinates += valid ? 1 : 0;
    }
  }
  Eigen::Vector4d prior;
  prior << motion.shift_px, motion.shift_px, motion.scale, motion.roll;
  prior = prior.cwiseAbs2().cwiseInverse();

  const auto normalOf = [&](const Eigen::MatrixXd& columns, const Eigen::VectorXd& of) {
    const Eigen::MatrixXd weighted = weight.asDiagonal() * columns;
    return Normal{columns.transpose() * weighted, weighted.transpose() * of};
  };
  struct Fit {
    Eigen::Vector3d shape = Eigen::Vector3d::Zero();
    Eigen::MatrixXd columns;  ///< by force and motion
    Eigen::VectorXd amounts, residual;
    double cost = std::numeric_limits<double>::infinity();
  };
  const auto fitAt = [&](const Eigen::Vector3d& shape, bool roughly) {
    Fit fit;
    fit.shape = shape;
    fit.columns.resize(rows, kLinear);
    fit.columns << unitFields(projection, shape, roughly), motions;
    Normal normal = normalOf(fit.columns, value);
    normal.matrix.diagonal().tail<4>() += prior;
    fit.amounts = normal.matrix.ldlt().solve(normal.right);
    fit.residual = value - fit.columns * fit.amounts;
    fit.cost = fit.residual.cwiseAbs2().dot(weight) + fit.amounts.tail<4>().cwiseAbs2().dot(prior);
    return fit;
  };
  const auto bounded = [&](Eigen::Vector3d shape) {
    shape.z() = std::clamp(shape.z(), kLeastRadius, kLargestRadius);
    for (int axis = 0; axis < 2; ++axis) {
      const double room = std::max(0.5 * sensor_.gel.size[axis] - shape.z() - kMargin, 0.0);
      shape[axis] = std::clamp(shape[axis], -room, room);
    }
    return shape;
  };

  const Eigen::Vector2d about = largestBulge(seen, {deformation, counts}, 0.0).place;
  Fit best;
  for (int y = -kFirstReach; y <= kFirstReach; ++y) {
    for (int x = -kFirstReach; x <= kFirstReach; ++x) {
      Fit trial = fitAt(bounded({about.x() + kFirstPitch * x, about.y() + kFirstPitch * y, kFirstRadius}), true);
      if (trial.cost < best.cost) best = std::move(trial);
    }
  }
  if (!std::isfinite(best.cost)) return std::nullopt;
  best = fitAt(best.shape, false);

  Normal normal;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::MatrixXd columns(rows, 3 + kLinear);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep_m * Eigen::Vector3d::Unit(k);
      columns.col(k) =
          (unitFields(projection, best.shape + step, true) - unitFields(projection, best.shape - step, true)) *
          best.amounts.head<3>() / (2 * kStep_m);
    }
    columns.rightCols(kLinear) = best.columns;
    normal = normalOf(columns, best.residual);
    normal.matrix.diagonal().tail<4>() += prior;
    normal.right.tail<4>() -= prior.cwiseProduct(best.amounts.tail<4>());
    const Eigen::VectorXd scale = normal.matrix.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::VectorXd change = scale.cwiseProduct(
        (scale.asDiagonal() * normal.matrix * scale.asDiagonal()).ldlt().solve(scale.cwiseProduct(normal.right)));
    if (!change.allFinite()) return std::nullopt;
    // Shortens the step until it reduces the residual; if no step does, the minimum is reached.
    Fit next;
    double share = 1.0;
    for (; share > 0.01; share *= 0.5) {
      next = fitAt(bounded(best.shape + share * change.head<3>()), false);
      if (next.cost <= best.cost) break;
    }
    if (next.cost > best.cost) break;
    const double moved = (next.shape - best.shape).norm();
    best = std::move(next);
    if (moved < kSettled_m) break;
  }

  const Eigen::VectorXd scale = normal.matrix.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * normal.matrix * scale.asDiagonal();
  const Eigen::MatrixXd covariance = scale.asDiagonal() *
                                     scaled.ldlt().solve(Eigen::MatrixXd::Identity(3 + kLinear, 3 + kLinear)) *
                                     scale.asDiagonal();
  const double excess = best.cost / (coordinates - kLinear - 3);
  ContactReading reading;
  reading.force = best.amounts.head<3>();
  reading.covariance = covariance.block<3, 3>(3, 3) * std::max(excess, 1.0);
  reading.place = best.shape.head<2>();
  reading.radius = best.shape.z();
  reading.residual_px = std::sqrt(weight.cwiseMin(1.0).dot(best.residual.cwiseAbs2()) / coordinates);
  double expected = 0.0;
  for (Eigen::Index i = 0; i < rows; ++i) expected += weight[i] > 0.0 ? 1.0 / weight[i] : 0.0;
  reading.expected_px = std::sqrt(expected / coordinates);
  if (!reading.force.allFinite() || !reading.covariance.allFinite()) return std::nullopt;
  return reading;
}

}  // namespace tractiond::calibrate
