#include "daemon/solve/field_writer.h"

#include "daemon/solve/mechanics_noise.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace tractiond::solve {
namespace {

/// Forces of fewer standard deviations of what the gel may remember, or of what heat may do, are taken for that.
/// Displacements of more standard deviations of noise, all together, may look like a force.
constexpr double kRemembered = 3.0, kSeen = 5.0;
/// Standard deviation of a false force by heat from which on an untouched field says so: 0.5 gf.
constexpr double kHeatForce_N = 5e-3;

/// Adds the covariance by errors of one deviation each, the columns.
template <typename Errors>
void addErrors(const Errors& errors, WrenchCovariance& to) {
  Matrix6::Map(to.data()) += errors * errors.transpose();
}

}  // namespace

FieldWriter::FieldWriter(const Factors& factors, const Atoms& atoms, const sensor::Sensor& sensor,
                         const SolveOptions& options, const std::array<double, 2>& detectionLimit_N)
    : factors_(factors)
    , atoms_(atoms)
    , mechanicsError_(std::hypot(factors.systematicErrors.displacement, sensor.uncertainty.model))
    , minPressForCentre_N_(options.minPressForCentre_N)
    , strain_(sensor::nodePositions(sensor), atoms.depth_m, sensor.gel.youngsModulus)
    , motion_(sensor.pictureMotion.shift_px, sensor.pictureMotion.shift_px, sensor.pictureMotion.scale,
              sensor.pictureMotion.roll)
    , least_N_(std::min(detectionLimit_N[0], detectionLimit_N[1]))
    , systematic_(factors, sensor)
    , contacts_(atoms, sensor, systematic_)
    , creep_(sensor)
    , used_(factors.coordinateCount() / 2, options)
    , nodeForce_(3 * atoms.nodeCount())
    , nodeDeviation_(nodeForce_.size()) {
  Eigen::Map<Eigen::Matrix<double, 6, 6>>(unseen_.data()) = unseen(sensor::nodePositions(sensor), detectionLimit_N);
}

bool FieldWriter::begin(const MarkerField& markers, TractionField& field) {
  assert(markers.valid.size() == used_.variance_px2().size() &&
         markers.displacement_px.size() == 2 * markers.valid.size());
  assert(field.markers.valid.size() == markers.valid.size() && field.force_N.size() == nodeForce_.size());
  field.markers = markers;
  field.flags = markers.flags;
  clear(field);
  if ((markers.flags & kGelMismatch) != 0) return false;  // numbers of another gel
  if ((markers.flags & kFewMarkers) != 0 || !used_.choose(markers)) {
    field.flags |= kFewMarkers;
    return false;
  }
  creep_.take(field.markers);
  return true;
}

Displacements FieldWriter::picture() const {
  const double* const row_px = used_.row_px().data();
  const double noise_px = noiseWithMechanics_px(used_.rounded_px(), used_.noise_px(), mechanicsError_);
  return {row_px, used_.missing(), dotProduct(row_px, row_px, factors_.coordinateCount()),
          std::hypot(noise_px, creep_.noise_px()), used_.rounded_px()};
}

void FieldWriter::write(const Estimate& estimate, Mixture& mixture, TractionField& field) {
  const std::uint32_t flags = field.flags;
  if (estimate.outcome != Estimate::Outcome::kFailed) publish(estimate, mixture, field);
  if (estimate.outcome == Estimate::Outcome::kFailed || !finite(field)) {
    clear(field);
    field.flags = flags;
    field.work.failed = true;
  }
  field.work.rounds = estimate.rounds;
  field.work.atoms = estimate.atoms;
  field.work.patchShare = estimate.patchShare;
  field.work.evenShare = estimate.evenShare;
}

void FieldWriter::publish(const Estimate& estimate, Mixture& mixture, TractionField& field) {
  field.valid = true;
  const RestDrift drift = field.markers.drift.isFollowed ? field.markers.drift : RestDrift{};
  const std::array<double, kMotions> before = {drift.shiftU_px, drift.shiftV_px, drift.scale, drift.roll};
  for (int k = 0; k < kMotions; ++k) field.pictureMotion[k] = before[k] + motion_[k] * estimate.motion[k];
  if (estimate.outcome == Estimate::Outcome::kFound) {
    field.method = Method::kContact;
    publishForces(estimate, mixture, field);
    field.systematic = systematic_.covariance(estimate.wrench, nodeForce_, double{field.markers.heatDeviation_K});
    field.contactCount = contacts_.list(estimate, mixture, least_N_, field.contacts);
    if (!addDrift(field)) publishNothing(field);
  } else {
    publishNothing(field);
  }
  explain(estimate.squaredResidual_px2, used_, field);
  centre(minPressForCentre_N_, field);
}

/// What lies below the limit is not seen, nor what the gel may remember, nor what heat may have moved.
void FieldWriter::publishNothing(TractionField& field) {
  const auto motion = field.pictureMotion;
  clear(field);
  field.valid = true;
  field.pictureMotion = motion;
  field.method = Method::kNoContact;
  field.noise = unseen_;
  const double seen = creep_.displacement_px() / (kSeen * used_.noise_px());
  std::ranges::transform(unseen_, field.systematic.begin(), [&](double each) { return square(seen) * each; });
  const auto heat_K = double{field.markers.heatDeviation_K};
  const Matrix6::ConstMapType byHeat(factors_.systematicErrors.contactHeat.data());
  Matrix6::Map(field.systematic.data()) += square(heat_K) * byHeat;
  const bool isWarmer = square(heat_K) * byHeat.topLeftCorner<3, 3>().trace() > square(kHeatForce_N);
  if (seen > 1.0 || isWarmer) field.flags |= kRecovering;
}

/// Adds what errors of the creep and of the temperature do, and removes contacts that may be nothing else. Returns
/// false if that is all that there is.
bool FieldWriter::addDrift(TractionField& field) const {
  const auto heat_K = double{field.markers.heatDeviation_K};
  if (creep_.displacement_px() <= 0.0 && heat_K <= 0.0) return true;
  const Matrix6 byHeat = square(heat_K) * Matrix6::Map(factors_.systematicErrors.contactHeat.data());
  Wrench beside = wrenchOf(field);
  Eigen::Matrix<double, 6, CreepErrors::kMost> errors;
  errors.setZero();
  int left = 0;
  for (int i = 0; i < field.contactCount; ++i) {
    Contact contact = field.contacts[i];
    const Eigen::Vector3d at(contact.position_m[0], contact.position_m[1], contact.positionZ_m);
    const CreepErrors::Shares shares = creep_.about(at);
    const Wrench own = wrenchOf(contact), wrench = toPoint(-at) * own;
    errors += wrench * shares.transpose();
    beside -= wrench;
    const Eigen::Vector3d force = own.head<3>();
    const double warmth = force.dot(byHeat.topLeftCorner<3, 3>() * force) / square(force.squaredNorm());
    if (std::hypot(shares.norm(), std::sqrt(warmth)) * kRemembered > 1.0) continue;
    addErrors(own * shares.transpose(), contact.systematic);
    Matrix6::Map(contact.systematic.data()) += byHeat;
    field.contacts[left++] = contact;
  }
  addErrors(errors + beside * creep_.ofAll().transpose(), field.systematic);
  const int removed = std::exchange(field.contactCount, left) - left;
  if (removed > 0) field.flags |= kRecovering;
  return removed == 0 || left > 0;
}

void FieldWriter::publishForces(const Estimate& estimate, Mixture& mixture, TractionField& field) {
  addAtNodes(atoms_, estimate.force_N, nodeForce_);
  if (strain_.outOfRange(nodeForce_)) field.flags |= kOutOfRange;
  mixture.nodeDeviations_N(nodeDeviation_);
  for (std::size_t i = 0; i < nodeForce_.size(); ++i) {
    field.force_N[i] = static_cast<float>(nodeForce_[i]);
    field.deviation_N[i] = static_cast<float>(nodeDeviation_[i]);
  }
  std::copy_n(estimate.wrench.begin(), 3, field.resultant_N.begin());
  std::copy_n(estimate.wrench.begin() + 3, 3, field.moment_Nm.begin());
  field.noise = estimate.covariance;
}

/// Returns the covariance of the wrench of a force just below the limit, anywhere on the nodes. It stays finite where
/// the limit is not: a force as large as the largest that was tried.
Eigen::Matrix<double, 6, 6> FieldWriter::unseen(const sensor::Points& nodes,
                                                const std::array<double, 2>& detectionLimit_N) const {
  const auto finite_N = [this](double limit_N) {
    return std::isfinite(limit_N) ? limit_N : kLargestDetectable * factors_.force_N;
  };
  const double tangential_N = finite_N(detectionLimit_N[0]), normal_N = finite_N(detectionLimit_N[1]);
  const Eigen::Vector3d deviations = 0.5 * Eigen::Vector3d(tangential_N, tangential_N, normal_N);
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  for (const auto& node : nodes.colwise()) {
    const Eigen::Matrix<double, 6, 3> wrenches = unitWrenches(node) * deviations.asDiagonal();
    covariance += wrenches * wrenches.transpose() / static_cast<double>(nodes.cols());
  }
  return covariance;
}

}  // namespace tractiond::solve
