// Tries places around that of the largest displacement as start values, and makes a few Gauss-Newton steps from the
// best one. The half-space part of a contact's field is summed over a quadrature of Hertz's pressure; the correction
// for the block, which varies over lengths of the block, over four points with the same second moments as the pressure.
// A body's field is that of its nodes, among which the contact is divided.
#include "daemon/calibrate/contact_fit.h"

#include "daemon/calibrate/scaled_equations.h"
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/influence.h"
#include "sensor/elastic/loads.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace tractiond::calibrate {

namespace {

constexpr double kLeastRadius = 0.5e-3, kLargestRadius = 15e-3;  // [m]
constexpr double kFirstRadius = 3e-3;
constexpr double kFirstPitch = 4e-3;  // distance of the places that are tried [m]
constexpr double kFirstNodes = 2.0;   // the same on a body, in distances of its nodes
constexpr int kFirstReach = 2;    // places to each side: the largest displacement is up to 8 mm away from the centre
constexpr double kMargin = 1e-3;  // between a contact and the sides of the gel [m]
constexpr int kIterations = 20;
constexpr double kStep_m = 1e-5;  // step of place and radius for finite differences
constexpr double kSettled_m = 1e-8;
constexpr int kLinear = 7;  // linear unknowns: force, picture motion

}  // namespace

/// Linearised equations of a trial.
struct ContactFit::Normal {
  ScaledEquations equations;
  Eigen::VectorXd solution;
};

/// The best fit of a contact of one shape (x, y, radius).
struct ContactFit::Trial {
  Eigen::Vector3d shape = Eigen::Vector3d::Zero();
  Eigen::MatrixXd columns;            ///< by force and motion of the picture
  Eigen::VectorXd amounts, residual;  ///< of these; what is left of the displacements [px]
  double cost = std::numeric_limits<double>::infinity();
};

Observed observe(const sensor::Sensor& seen, const Displacements& displacements, std::span<const float> variance_px2) {
  const auto markers = static_cast<Eigen::Index>(displacements.valid.size());
  Observed observed;
  observed.value_px.setZero(2 * markers);
  observed.weight.setZero(2 * markers);
  observed.byMotion = sensor::elastic::pictureMotionMatrix(seen);
  for (Eigen::Index m = 0; m < markers; ++m) {
    const auto marker = static_cast<std::size_t>(m);
    if (displacements.valid[marker] == 0 || !(variance_px2[marker] > 0.0F)) continue;
    observed.weight.segment<2>(2 * m).setConstant(1.0 / static_cast<double>(variance_px2[marker]));
    observed.value_px.segment<2>(2 * m) =
        Eigen::Vector2f::Map(displacements.value_px.data() + 2 * marker).cast<double>();
    observed.coordinates += 2;
  }
  const sensor::PictureMotion& motion = seen.pictureMotion;
  observed.motionWeight << motion.shift_px, motion.shift_px, motion.scale, motion.roll;
  observed.motionWeight = observed.motionWeight.cwiseAbs2().cwiseInverse().eval();
  return observed;
}

ContactFit::ContactFit(const sensor::Sensor& sensor)
    : sensor_(sensor)
    , markers_(sensor::markerPositions(sensor)) {
  if (sensor.body) {
    surface_.emplace(sensor);
  } else {
    correction_.emplace(sensor.gel, markers_);
  }
}

Eigen::MatrixXd ContactFit::bodyFields(const sensor::Projection& projection, const Eigen::Vector3d& shape,
                                       const Eigen::MatrixXd& influence) const {
  const Eigen::VectorXd shares =
      surface_->patch(shape).shares * (sensor_.body->youngsModulus / sensor_.gel.youngsModulus);
  Eigen::MatrixXd displacement = Eigen::MatrixXd::Zero(influence.rows(), 3);
  for (Eigen::Index n = 0; n < shares.size(); ++n) displacement += shares[n] * influence.middleCols<3>(3 * n);
  Eigen::MatrixXd fields(2 * markers_.cols(), 3);
  for (Eigen::Index m = 0; m < markers_.cols(); ++m) {
    fields.middleRows<2>(2 * m) = projection.jacobian(markers_.col(m)) * displacement.middleRows<3>(3 * m);
  }
  return fields;
}

Eigen::MatrixXd ContactFit::fieldErrors(const sensor::Camera& camera, const Eigen::Vector3d& shape,
                                        std::size_t number) const {
  return bodyFields(sensor::Projection(camera, sensor_.gel.size.z()), shape, sensor_.body->errors[number]);
}

Eigen::MatrixXd ContactFit::unitFields(const sensor::Projection& projection, const Eigen::Vector3d& shape, bool roughly,
                                       double deeper) const {
  if (surface_) return bodyFields(projection, shape, sensor_.body->influence);
  const Eigen::Vector2d place = shape.head<2>();
  const double radius = shape.z();
  const auto patch = sensor::elastic::hertz(place, radius, Eigen::Vector3d::UnitZ());
  const double arm = radius * std::sqrt(0.4);
  sensor::Points corners = sensor::Points::Zero(3, roughly ? 1 : 4);
  corners.topRows<2>().colwise() = place;
  if (!roughly) corners.topRows<2>() += arm * (Eigen::Matrix<double, 2, 4>() << 1, -1, 0, 0, 0, 0, 1, -1).finished();
  const Eigen::MatrixXd corrections = correction_->matrix(corners);
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

/// Fits force and motion for a shape.
ContactFit::Trial ContactFit::at(const sensor::Projection& projection, const Observed& observed,
                                 const Eigen::Vector3d& shape, bool roughly) const {
  Trial trial;
  trial.shape = shape;
  trial.columns.resize(observed.value_px.size(), kLinear);
  trial.columns << unitFields(projection, shape, roughly), observed.byMotion;
  const Eigen::MatrixXd weighted = observed.weight.asDiagonal() * trial.columns;
  Eigen::MatrixXd matrix = trial.columns.transpose() * weighted;
  matrix.diagonal().tail<4>() += observed.motionWeight;
  trial.amounts = matrix.ldlt().solve(weighted.transpose() * observed.value_px);
  trial.residual = observed.value_px - trial.columns * trial.amounts;
  trial.cost =
      trial.residual.cwiseAbs2().dot(observed.weight) + trial.amounts.tail<4>().cwiseAbs2().dot(observed.motionWeight);
  return trial;
}

/// Tries places around one.
ContactFit::Trial ContactFit::first(const sensor::Projection& projection, const Observed& observed,
                                    const Eigen::Vector2d& about) const {
  Trial best;
  const double pitch = surface_ ? kFirstNodes * surface_->pitch() : kFirstPitch;
  for (int y = -kFirstReach; y <= kFirstReach; ++y) {
    for (int x = -kFirstReach; x <= kFirstReach; ++x) {
      const Eigen::Vector2d place = about + pitch * Eigen::Vector2d(x, y);
      Trial trial = at(projection, observed, bounded({place.x(), place.y(), kFirstRadius}), true);
      if (trial.cost < best.cost) best = std::move(trial);
    }
  }
  return std::isfinite(best.cost) ? at(projection, observed, best.shape, false) : best;
}

/// Linearises about a trial: changes of the shape, of force and motion.
ContactFit::Normal ContactFit::about(const sensor::Projection& projection, const Observed& observed,
                                     const Trial& trial) const {
  Eigen::MatrixXd columns(observed.value_px.size(), 3 + kLinear);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d step = kStep_m * Eigen::Vector3d::Unit(k);
    columns.col(k) =
        (unitFields(projection, trial.shape + step, true) - unitFields(projection, trial.shape - step, true)) *
        trial.amounts.head<3>() / (2 * kStep_m);
  }
  columns.rightCols(kLinear) = trial.columns;
  const Eigen::MatrixXd weighted = observed.weight.asDiagonal() * columns;
  Eigen::MatrixXd matrix = columns.transpose() * weighted;
  Eigen::VectorXd right = weighted.transpose() * trial.residual;
  matrix.diagonal().tail<4>() += observed.motionWeight;
  right.tail<4>() -= observed.motionWeight.cwiseProduct(trial.amounts.tail<4>());
  const ScaledEquations equations(matrix);
  return {equations, equations.solve(right)};
}

Eigen::Vector3d ContactFit::bounded(const Eigen::Vector3d& shape) const {
  if (surface_) return surface_->bounded(shape);
  const double radius = std::clamp(shape.z(), kLeastRadius, kLargestRadius);
  const Eigen::Vector2d room = (0.5 * sensor_.gel.size.head<2>().array() - radius - kMargin).max(0.0);
  const Eigen::Vector2d place = shape.head<2>().cwiseMax(-room).cwiseMin(room);
  return {place.x(), place.y(), radius};
}

std::optional<ContactReading> ContactFit::operator()(const sensor::Sensor& seen, const Displacements& displacements,
                                                     std::span<const float> variance_px2) const {
  const sensor::Projection projection(seen.camera, sensor_.gel.size.z());
  const Observed observed = observe(seen, displacements, variance_px2);
  std::vector<std::uint8_t> counts(displacements.valid.size());
  for (std::size_t m = 0; m < counts.size(); ++m) counts[m] = observed.weight[static_cast<Eigen::Index>(2 * m)] > 0.0;
  const auto whole = PictureMotionFit(seen)({displacements.value_px, counts});
  if (!whole) return std::nullopt;
  const Eigen::VectorXf deformation = (observed.value_px - observed.byMotion * whole->value).cast<float>();
  const std::span<const float> deformed(deformation.data(), displacements.value_px.size());

  const Eigen::Vector2d moved = largestBulge(seen, {deformed, counts}, 0.0).place;
  Trial best = first(projection, observed, surface_ ? surface_->nearest(moved) : moved);
  if (!std::isfinite(best.cost)) return std::nullopt;
  Normal normal;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    normal = about(projection, observed, best);
    if (!normal.solution.allFinite()) return std::nullopt;
    // Shortens the step until it reduces the residual; if no step does, the minimum is reached.
    Trial next;
    for (double share = 1.0; share > 0.01 && !(next.cost <= best.cost); share *= 0.5) {
      next = at(projection, observed, bounded(best.shape + share * normal.solution.head<3>()), false);
    }
    if (next.cost > best.cost) break;
    const double step = (next.shape - best.shape).norm();
    best = std::move(next);
    if (step < kSettled_m) break;
  }

  const double excess = best.cost / (observed.coordinates - kLinear - 3);
  ContactReading reading;
  reading.force = best.amounts.head<3>();
  reading.covariance = normal.equations.inverse().block<3, 3>(3, 3) * std::max(excess, 1.0);
  reading.shape = best.shape;
  reading.place.head<2>() = best.shape.head<2>();
  reading.radius = best.shape.z();
  if (surface_) {
    const BodySurface::Patch patch = surface_->patch(best.shape);
    reading.place = patch.place;
    reading.normal = patch.normal;
  }
  const auto rootMean = [&](double squares) { return std::sqrt(squares / observed.coordinates); };
  reading.residual_px = rootMean(observed.weight.cwiseMin(1.0).dot(best.residual.cwiseAbs2()));
  reading.expected_px = rootMean((observed.weight.array() > 0.0).select(observed.weight.cwiseInverse(), 0.0).sum());
  if (!reading.force.allFinite() || !reading.covariance.allFinite()) return std::nullopt;
  return reading;
}

}  // namespace tractiond::calibrate
