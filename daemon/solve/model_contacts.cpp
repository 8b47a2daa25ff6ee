#include "daemon/solve/model_contacts.h"

#include "daemon/solve/ellipse.h"
#include "daemon/solve/wrench.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// What is found farther than this from the edge of a patch, an even disc, does not lie at it [pitches].
constexpr double kBeside = 1.5;

/// A force that a point has besides those of the patches belongs to the nearest one, as far as it is more than this
/// share of their force.
constexpr double kShareOfNearest = 1e-3;

auto forceOf(const Estimate& estimate, std::size_t point) {
  return Vector3d::Map(estimate.force_N.data() + 3 * point);
}

}  // namespace

ModelContacts::ModelContacts(const Atoms& atoms, const sensor::Sensor& sensor, const SystematicPart& systematic)
    : atoms_(atoms)
    , systematic_(systematic)
    , spread_(atoms)
    , hills_(atoms, sensor)
    , has_(atoms.pointCount())
    , nearest_(has_.size())
    , part_(has_.size())
    , forces_(3 * has_.size())
    , nodeForces_(3 * atoms.nodeCount())
    , weights_(3 * kColumns * (has_.size() + kCouples)) {
  for (auto& each : ofPatch_) each.resize(3 * (has_.size() + kCouples));
  points_.reserve(has_.size() + kCouples);
}

int ModelContacts::list(const Estimate& estimate, Mixture& mixture, double least_N,
                        std::array<Contact, kMaxContacts>& contacts) {
  if (estimate.patchShare > 0.5) return listPatches(estimate, mixture, least_N, contacts);
  std::fill(has_.begin(), has_.end(), 1);
  hills_.take(estimate, mixture, has_);
  if (estimate.evenShare <= 0.5) return listHills(contacts);
  hills_.unite();
  contacts[0] = *describeHill(0, 0.0, 0.0);
  return 1;
}

/// Lists the hill of the highest peak, and those with a significance above Hills::kLeast_deviations; of more than
/// kMaxContacts, those of the highest peaks.
int ModelContacts::listHills(std::array<Contact, kMaxContacts>& contacts) {
  hills_.divide();
  std::size_t count = 0;
  for (int hill = 0; hill < hills_.count() && count < kMaxContacts; ++hill) {
    if (!hills_.stands(hill)) continue;
    const double least = count == 0 ? 0.0 : Hills::kLeast_deviations;
    if (const auto contact = describeHill(hill, least, 0.0)) contacts[count++] = *contact;
  }
  Hills::sort(std::span(contacts).first(count));
  return static_cast<int>(count);
}

/// Describes a hill as a contact, if it is one, and sets forces_ to its own.
std::optional<Contact> ModelContacts::describeHill(int hill, double least_deviations, double least_N) {
  std::optional<Contact> contact = hills_.describe(hill, least_deviations, least_N);
  if (!contact) return contact;
  hills_.forcesOf(hill, forces_);
  addSystematic(*contact);
  return contact;
}

/// Adds the systematic part. forces_: those of the contact.
void ModelContacts::addSystematic(Contact& contact) {
  const Vector3d at(contact.position_m[0], contact.position_m[1], contact.positionZ_m);
  addAtNodes(atoms_, forces_, nodeForces_);
  contact.systematic = covarianceAt(at, systematic_.covariance(toPoint(-at) * wrenchOf(contact), nodeForces_));
}

int ModelContacts::listPatches(const Estimate& estimate, Mixture& mixture, double least_N,
                               std::array<Contact, kMaxContacts>& contacts) {
  static_assert(kMost <= kMaxContacts);
  share(estimate);
  std::array<Contact, kMost> patched;
  int patchedCount = 0;
  int count = listBeside(estimate, mixture, least_N, contacts);
  for (int k = 0; k < estimate.patchCount; ++k) {
    if (estimate.patches[k].contact == k) {
      patched[patchedCount++] = describe(estimate, mixture, k);
    }
  }
  const auto ofPatches = std::span(patched).first(patchedCount);
  Hills::sort(ofPatches);
  for (const Contact& contact : ofPatches) {
    const bool first = &contact == ofPatches.data();
    if (first || Hills::significance(contact) > Hills::kLeast_deviations) contacts[count++] = contact;
  }
  Hills::sort(std::span(contacts).first(count));
  return count;
}

/// Finds the patches' forces at the points, the patch that each point is nearest to, and those that lie beside all.
void ModelContacts::share(const Estimate& estimate) {
  for (int k = 0; k < estimate.patchCount; ++k) {
    const RoundPatch& patch = estimate.patches[k].patch;
    spread_.divide(patch.place, true);
    std::fill(ofPatch_[k].begin(), ofPatch_[k].end(), 0.0);
    spread_.add(patch.load, k, ofPatch_[k]);
  }
  for (std::size_t p = 0; p < has_.size(); ++p) {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < estimate.patchCount; ++k) {
      const PatchPlace& place = estimate.patches[k].patch.place;
      const Vector2d away = atoms_.points.col(p).head<2>() - Vector2d(place.x_m, place.y_m);
      const double fromEdge = away.norm() - 2.0 * std::sqrt(std::max(place.spread_m2, 0.0));
      if (fromEdge >= least) continue;
      least = fromEdge;
      nearest_[p] = k;
    }
    has_[p] = least > kBeside * atoms_.pitch_m ? 1 : 0;
  }
}

/// Lists what lies beside all patches. Leaves in has_ the points of these contacts.
int ModelContacts::listBeside(const Estimate& estimate, Mixture& mixture, double least_N,
                              std::array<Contact, kMaxContacts>& contacts) {
  double sum = 0.0;
  for (std::size_t p = 0; p < has_.size(); ++p) {
    if (has_[p]) sum += forceOf(estimate, p).norm();
  }
  if (sum > least_N) {
    hills_.take(estimate, mixture, has_);
    hills_.divide();
  }
  std::fill(has_.begin(), has_.end(), 0);
  if (sum <= least_N) return 0;
  int count = 0;
  for (int hill = 0; hill < hills_.count() && count < kMaxContacts - kMost; ++hill) {
    if (!hills_.stands(hill)) continue;
    const auto contact = describeHill(hill, Hills::kLeast_deviations, least_N);
    if (!contact) continue;
    contacts[count++] = *contact;
    for (std::size_t p = 0; p < has_.size(); ++p) {
      if (!Vector3d::Map(forces_.data() + 3 * p).isZero(0.0)) has_[p] = 1;
    }
  }
  return count;
}

/// Finds the parts that a contact of patches has in the forces of the points, and these forces. Returns their sum.
Vector3d ModelContacts::gather(const Estimate& estimate, int contact) {
  const auto patches = std::span(estimate.patches).first(estimate.patchCount);
  double nearest_N = 0.0;
  for (const FoundPatch& each : patches) nearest_N += kShareOfNearest * each.patch.load.head<3>().norm();
  Vector3d sum = Vector3d::Zero();
  for (std::size_t p = 0; p < has_.size(); ++p) {
    // The patches' own forces are known; what is there besides is divided by their strength.
    double own_N = 0.0, all_N = nearest_N;
    Vector3d rest = forceOf(estimate, p), own = Vector3d::Zero();
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const Vector3d force = Vector3d::Map(ofPatch_[k].data() + 3 * p);
      all_N += force.norm();
      rest -= force;
      if (patches[k].contact != contact) continue;
      own_N += force.norm() + (nearest_[p] == static_cast<int>(k) ? nearest_N : 0.0);
      own += force;
    }
    part_[p] = has_[p] ? 0.0 : own_N / all_N;
    const Vector3d here = has_[p] ? Vector3d::Zero() : Vector3d(own + part_[p] * rest);
    Vector3d::Map(forces_.data() + 3 * p) = here;
    sum += here;
  }
  return sum;
}

/// Describes a contact of patches: their forces and couples, and its part of what is found besides.
Contact ModelContacts::describe(const Estimate& estimate, Mixture& mixture, int contact) {
  const Vector3d force = gather(estimate, contact);
  Vector3d moment = Vector3d::Zero();
  for (std::size_t p = 0; p < has_.size(); ++p) {
    moment += atoms_.points.col(p).cross(Vector3d::Map(forces_.data() + 3 * p));
  }
  bool isAll = std::count(has_.begin(), has_.end(), 1) == 0;
  for (int k = 0; k < estimate.patchCount; ++k) {
    if (estimate.patches[k].contact == contact)
      moment += Vector3d::Map(estimate.couple_Nm.data() + std::ptrdiff_t{3} * k);
    else
      isAll = false;
  }
  // The noise of all that was found is known. Else, and where nothing presses, it takes functionals.
  WrenchCovariance noise = estimate.covariance;
  const auto presses = [&] { return force.z() > Hills::kLeast_deviations * std::sqrt(noise[14]); };
  Vector2d ofAll = Vector2d::Zero(), ofAllDeviation = ofAll;
  if (!isAll || !presses()) {
    ofAll = setFunctionals(estimate, contact, force);
    std::array<double, kColumns * kColumns> covariances{};
    mixture.covariance(weights_, points_, covariances);
    noise = firstSix(covariances);
    for (Index i = 0; i < 2; ++i) ofAllDeviation[i] = std::sqrt(covariances[(kColumns + 1) * (6 + i)]);
  }
  Contact result;
  if (presses()) {  // about its centre, the moment across the normal is by the shift of the centre alone
    setWrench(force, moment, noise, Vector3d(-moment.y(), moment.x(), 0.0) / force.z(), result);
    result.positionDeviation_m = {std::sqrt(result.noise[28]) / force.z(), std::sqrt(result.noise[21]) / force.z()};
  } else {
    setWrench(force, moment, noise, Vector3d(ofAll.x(), ofAll.y(), 0.0), result);
    Vector2d::Map(result.positionDeviation_m.data()) = ofAllDeviation;
  }
  setShape(estimate, contact, presses() ? Vector3d::UnitZ() : Vector3d(force.normalized()), result);
  setRound(estimate, contact, result);
  addSystematic(result);
  return result;
}

/// Sets the functionals of a contact of patches: its wrench about the origin, then the centre of its forces along their
/// sum. Returns this centre.
Vector2d ModelContacts::setFunctionals(const Estimate& estimate, int contact, const Vector3d& force) {
  const Vector3d along = force / force.squaredNorm();
  Vector2d centre = Vector2d::Zero();
  for (std::size_t p = 0; p < has_.size(); ++p) {
    centre += along.dot(Vector3d::Map(forces_.data() + 3 * p)) * atoms_.points.col(p).head<2>();
  }
  points_.clear();
  for (std::size_t p = 0; p < has_.size(); ++p) {
    if (part_[p] == 0.0) continue;
    points_.push_back(static_cast<int>(p));
    const Vector3d at = atoms_.points.col(p);
    double* const weights = weights_.data() + 3 * kColumns * p;
    writeWrenches(at, part_[p], weights, kColumns);
    for (Index axis = 0; axis < 3; ++axis) {
      Vector2d::Map(weights + kColumns * axis + 6) = part_[p] * along[axis] * (at.head<2>() - centre);
    }
  }
  for (int k = 0; k < estimate.patchCount; ++k) {
    if (estimate.patches[k].contact != contact) continue;
    points_.push_back(atoms_.pointCount() + k);
    double* const weights = weights_.data() + std::ptrdiff_t{3 * kColumns} * points_.back();
    std::fill_n(weights, 3 * kColumns, 0.0);
    for (int axis = 0; axis < 3; ++axis) weights[kColumns * axis + 3 + axis] = 1.0;
  }
  return centre;
}

/// Gives the shape of a contact of patches: of several, the squares of their pressures add up to that of its area, and
/// their places scatter. Each counts as round, and apart from the others and from what is found besides.
void ModelContacts::setShape(const Estimate& estimate, int contact, const Vector3d& along, Contact& result) {
  const auto each = [&](auto use) {
    for (const FoundPatch& found : std::span(estimate.patches).first(estimate.patchCount)) {
      if (found.contact != contact) continue;
      const auto& [place, load] = found.patch;
      const double spread = std::max(place.spread_m2, std::sqrt(found.covariance(6, 6)));
      use(found.covariance, Vector2d(place.x_m, place.y_m), spread, Vector3d(load.head<3>()));
    }
  };
  double sum = 0.0, squares = 0.0, total = 0.0, least = std::numeric_limits<double>::infinity();
  Vector2d centre = Vector2d::Zero();
  each([&](const auto&, const Vector2d& at, double spread, const Vector3d& force) {
    sum += force.norm();
    squares += force.squaredNorm() / (4.0 * std::numbers::pi * spread);
    total += along.dot(force);
    centre += along.dot(force) * at;
    least = std::min(least, spread);
  });
  centre /= total;
  result.area_m2 = square(sum) / squares;
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  each([&](const auto&, const Vector2d& at, double spread, const Vector3d& force) {
    moments +=
        along.dot(force) / total * (spread * Eigen::Matrix2d::Identity() + (at - centre) * (at - centre).transpose());
  });
  const Ellipse ellipse(moments, least);
  Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
  each([&](const auto& ofPatch, const Vector2d& at, double spread, const Vector3d& force) {
    const Vector2d away = ellipse.axes.transpose() * (at - centre);
    const double weight = along.dot(force) / total;
    Eigen::Matrix<double, Ellipse::kNumbers, kPerPatch> by = decltype(by)::Zero();
    by(0, 6) = square(result.area_m2 / sum) * force.squaredNorm() / (4.0 * std::numbers::pi * square(spread));
    const Vector3d ofForce =
        ellipse.unit(at - centre) + Vector3d(spread - ellipse.moments[0], spread - ellipse.moments[1], 0.0);
    by.block<3, 3>(1, 0) = ofForce * along.transpose() / total;
    by.block<1, 2>(1, 4) = 2.0 * weight * away.x() * ellipse.axes.col(0).transpose();
    by.block<1, 2>(2, 4) = 2.0 * weight * away.y() * ellipse.axes.col(1).transpose();
    by.block<1, 2>(3, 4) = weight * (away.y() * ellipse.axes.col(0) + away.x() * ellipse.axes.col(1)).transpose();
    by(1, 6) = by(2, 6) = weight;
    covariance += by * ofPatch * by.transpose();
  });
  solve::setShape(ellipse, covariance, result);
}

/// Gives the radius of a contact that is one patch, by its area, and how far its shear is spread.
void ModelContacts::setRound(const Estimate& estimate, int contact, Contact& result) {
  const FoundPatch* only = nullptr;
  for (int k = 0; k < estimate.patchCount; ++k) {
    const FoundPatch& found = estimate.patches[k];
    if (found.contact != contact) continue;
    if (only != nullptr) return;
    only = &found;
  }
  result.spreadRatio = only->spreadRatio.value;
  result.spreadRatioDeviation = only->spreadRatio.deviation;
  result.hertzRadius_m = std::sqrt(5.0 * result.area_m2 / (4.0 * std::numbers::pi));  // of its spread, radius^2 / 5
  result.hertzRadiusDeviation_m = 0.5 * result.hertzRadius_m * result.areaDeviation_m2 / result.area_m2;
}

}  // namespace tractiond::solve
