#include "daemon/solve/model_solver.h"

#include "daemon/solve/mechanics_noise.h"
#include "daemon/solve/systematic.h"
#include "daemon/solve/wrench.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace tractiond::solve {
namespace {

// Forces that detectionLimit() tries first, as shares of Factors::force_N: kFirst, then doubled so many times.
constexpr double kFirst = 5e-4;
constexpr int kDoublings = 15;
constexpr double kLargest = kFirst * (1 << kDoublings);

/// Returns the mean pressure [Pa] on an area as large as a node's in the middle of a patch, which presses as a ball
/// does: for a patch smaller than that, all of its force on this area.
double pressureInside(const RoundPatch& patch, double area_m2) {
  const double inner2_m2 = area_m2 / std::numbers::pi, radius2_m2 = 5.0 * patch.place.spread_m2;
  const double share = inner2_m2 < radius2_m2 ? 1.0 - std::pow(1.0 - inner2_m2 / radius2_m2, 1.5) : 1.0;
  return share * patch.load.head<3>().norm() / area_m2;
}

}  // namespace

ModelSolver::ModelSolver(const Factors& factors, const Atoms& atoms, const sensor::Sensor& sensor,
                         const SolveOptions& options, const std::optional<std::array<double, 2>>& detectionLimit_N)
    : factors_(factors)
    , atoms_(atoms)
    , uncertainty_(sensor.uncertainty)
    , noise_px_(options.noise_px)
    , rules_(sensor, options)
    , motion_(sensor.pictureMotion.shift_px, sensor.pictureMotion.shift_px, sensor.pictureMotion.scale,
              sensor.pictureMotion.roll)
    , model_(sensor, factors, atoms, modelOptions(options))
    , contacts_(atoms, sensor)
    , used_(factors.coordinateCount() / 2, options)
    , picture_(static_cast<std::size_t>(factors.coordinateCount()))
    , nodeForce_(3 * rules_.nodes().size())
    , nodeDeviation_(nodeForce_.size()) {
  estimate_.force_N.resize(3 * static_cast<std::size_t>(atoms.pointCount()));
  detectionLimit_N_ = detectionLimit_N ? *detectionLimit_N : std::array{detectionLimit(0), detectionLimit(2)};
  Eigen::Map<Eigen::Matrix<double, 6, 6>>(unseen_.data()) = unseen();
}

void ModelSolver::solve(const MarkerField& markers, TractionField& field) noexcept {
  assert(2 * markers.valid.size() == picture_.size() && markers.displacement_px.size() == picture_.size());
  assert(field.markers.valid.size() == markers.valid.size() && field.force_N.size() == nodeForce_.size());
  field.markers = markers;
  field.flags = markers.flags;
  FieldRules::clear(field);
  if ((markers.flags & kGelMismatch) != 0) return;  // numbers of another gel
  if ((markers.flags & kFewMarkers) != 0 || !used_.choose(markers)) {
    field.flags |= kFewMarkers;
    return;
  }
  std::copy_n(used_.row_px().begin(), picture_.size(), picture_.begin());
  estimate(used_.missing(), used_.noise_px());
  if (estimate_.outcome != Estimate::Outcome::kFailed) publish(field);
  if (estimate_.outcome == Estimate::Outcome::kFailed || !FieldRules::finite(field)) {
    FieldRules::clear(field);
    field.flags = markers.flags;
    field.work.failed = true;
  }
  field.work.rounds = estimate_.rounds;
  field.work.atoms = estimate_.atoms;
  field.work.patchShare = estimate_.patchShare;
  field.work.evenShare = estimate_.evenShare;
}

/// Solves picture_, with the noise of the mechanics beside that of a coordinate.
void ModelSolver::estimate(std::span<const int> missing, double noise_px) {
  const std::span<const float> picture(picture_);
  const double error = std::hypot(factors_.systematicErrors.displacement, uncertainty_.model);
  model_.solve(picture, missing, noiseWithMechanics_px(picture, noise_px, error), estimate_);
}

void ModelSolver::publish(TractionField& field) {
  field.valid = true;
  for (int k = 0; k < kMotions; ++k) field.pictureMotion[k] = motion_[k] * estimate_.motion[k];
  if (estimate_.outcome == Estimate::Outcome::kFound) {
    field.method = Method::kContact;
    publishForces(field);
    addSystematic(field);
    const double least_N = std::min(detectionLimit_N_[0], detectionLimit_N_[1]);
    field.contactCount = contacts_.list(estimate_, model_.mixture(), least_N, field.contacts);
  } else {  // what lies below the limit is not seen
    field.method = Method::kNoContact;
    field.noise = unseen_;
  }
  FieldRules::explain(estimate_.squaredResidual_px2, used_, field);
  rules_.centre(field);
}

void ModelSolver::publishForces(TractionField& field) {
  std::fill(nodeForce_.begin(), nodeForce_.end(), 0.0);
  for (int p = 0; p < atoms_.pointCount(); ++p) {
    const Eigen::Vector3d force = Eigen::Vector3d::Map(estimate_.force_N.data() + 3 * static_cast<std::ptrdiff_t>(p));
    const int node = atoms_.nodeOf(p);
    Eigen::Vector3d::Map(nodeForce_.data() + 3 * static_cast<std::ptrdiff_t>(node)) += force;
  }
  for (std::size_t n = 0; n < rules_.nodes().size(); ++n) {
    const double force2 = Eigen::Vector3d::Map(nodeForce_.data() + 3 * n).squaredNorm();
    if (rules_.outOfRange(n, force2)) field.flags |= kOutOfRange;
  }
  // A patch is narrower than the points that its force is spread over.
  for (int k = 0; estimate_.patchShare > 0.5 && k < estimate_.patchCount; ++k) {
    const RoundPatch& patch = estimate_.patches[static_cast<std::size_t>(k)].patch;
    if (rules_.outOfRange(pressureInside(patch, square(atoms_.pitch_m)))) field.flags |= kOutOfRange;
  }
  model_.mixture().nodeDeviations_N(nodeDeviation_);
  for (std::size_t i = 0; i < nodeForce_.size(); ++i) {
    field.force_N[i] = static_cast<float>(nodeForce_[i]);
    field.deviation_N[i] = static_cast<float>(nodeDeviation_[i]);
  }
  std::copy_n(estimate_.wrench.begin(), 3, field.resultant_N.begin());
  std::copy_n(estimate_.wrench.begin() + 3, 3, field.moment_Nm.begin());
  field.noise = estimate_.covariance;
}

/// A contact is misread as the nodes around it misread it, one on all nodes as these; between the two by the share of
/// the face that an even pressure as concentrated would cover.
void ModelSolver::addSystematic(TractionField& field) const {
  double sum = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < nodeForce_.size(); i += 3) {
    const double force2 = square(nodeForce_[i]) + square(nodeForce_[i + 1]) + square(nodeForce_[i + 2]);
    sum += std::sqrt(force2);
    squares += force2;
  }
  if (squares == 0.0) return;
  const double whole = square(sum) / squares / static_cast<double>(nodeForce_.size() / 3);
  field.systematic = systematicCovariance(wrenchOf(field), rules_.centroid(field), uncertainty_, atoms_.pitch_m,
                                          factors_.systematicErrors, whole);
}

/// Returns the covariance of the wrench of a force just below the limit, anywhere on the nodes. It stays finite where
/// the limit is not: a force as large as the largest that was tried.
Eigen::Matrix<double, 6, 6> ModelSolver::unseen() const {
  const auto finite_N = [this](double limit_N) {
    return std::isfinite(limit_N) ? limit_N : kLargest * factors_.force_N;
  };
  const double tangential_N = finite_N(detectionLimit_N_[0]), normal_N = finite_N(detectionLimit_N_[1]);
  const Eigen::Vector3d deviations = 0.5 * Eigen::Vector3d(tangential_N, tangential_N, normal_N);
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  for (const std::array<double, 3>& node : rules_.nodes()) {
    const Eigen::Matrix<double, 6, 3> wrenches =
        unitWrenches(Eigen::Vector3d::Map(node.data())) * deviations.asDiagonal();
    covariance += wrenches * wrenches.transpose() / static_cast<double>(rules_.nodes().size());
  }
  return covariance;
}

/// Solves pictures of a force on each of nine points, raised until something is found and then halved in between.
double ModelSolver::detectionLimit(int axis) {
  constexpr int kHalvings = 5;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal(0.0, noise_px_);
  std::vector<double> limits;
  std::vector<double> noise(picture_.size());
  const int points = atoms_.pointCount();
  for (int i = 0; i < 9; ++i) {
    // A third of the way apart on either axis of the grid; of a body, anywhere.
    const int columns = atoms_.columns, rows = atoms_.rows;
    const int point =
        columns > 0 ? (1 + i / 3) * rows / 4 * columns + (1 + i % 3) * columns / 4 : (2 * i + 1) * points / 18;
    const float* const unit = factors_.influence.row(3 * point + axis);
    for (double& each : noise) each = normal(generator);
    const auto finds = [&](double force_N) {
      for (std::size_t k = 0; k < noise.size(); ++k) picture_[k] = static_cast<float>(force_N * unit[k] + noise[k]);
      estimate({}, noise_px_);
      return estimate_.outcome == Estimate::Outcome::kFound;
    };
    double high = kFirst * factors_.force_N;
    bool isFound = false;
    for (int doubling = 0; doubling < kDoublings && !isFound; ++doubling) {
      isFound = finds(high);
      if (!isFound) high *= 2.0;
    }
    double low = 0.5 * high;
    for (int halving = 0; halving < kHalvings; ++halving) {
      const double middle = 0.5 * (low + high);
      const bool isFoundInBetween = finds(middle);
      (isFoundInBetween ? high : low) = middle;
      isFound = isFound || isFoundInBetween;
    }
    limits.push_back(isFound ? high : std::numeric_limits<double>::infinity());
  }
  std::nth_element(limits.begin(), limits.begin() + 4, limits.end());
  return limits[4];
}

}  // namespace tractiond::solve
