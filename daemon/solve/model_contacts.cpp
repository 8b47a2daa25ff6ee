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
using Vector6 = Eigen::Matrix<double, 6, 1>;

/// What is found farther than this from the edge of a patch, an even disc, does not lie at it [pitches].
constexpr double kBeside = 1.5;

/// A force that a point has besides those of the patches belongs to the nearest one, as far as it is more than this
/// share of their force.
constexpr double kShareOfNearest = 1e-3;

PlaceGrid gridOf(const Atoms& atoms, const sensor::Sensor& sensor) {
  const bool isBody = atoms.columns == 0;
  PlaceGrid grid{isBody ? sensor.nodes.columns : atoms.columns, isBody ? sensor.nodes.rows : atoms.rows, atoms.points,
                 sensor::Points(3, atoms.pointCount()), Eigen::VectorXd(atoms.pointCount())};
  const sensor::Points normals = sensor::nodeNormals(sensor);
  const Eigen::VectorXd areas = sensor::nodeAreas(sensor);
  for (int p = 0; p < atoms.pointCount(); ++p) {
    grid.normals.col(p) = normals.col(atoms.nodeOf(p));
    grid.areas[p] = areas[atoms.nodeOf(p)];
  }
  return grid;
}

/// Returns force and moment of a contact about its point [N, N m].
Vector6 wrenchOf(const Contact& contact) {
  Vector6 wrench;
  wrench << Vector3d::Map(contact.force_N.data()), Vector3d::Map(contact.moment_Nm.data());
  return wrench;
}

auto forceOf(const Estimate& estimate, Index point) {
  return Vector3d::Map(estimate.force_N.data() + 3 * point);
}

}  // namespace

ModelContacts::Found::Found(const Atoms& atoms)
    : atoms_(atoms)
    , forces_(3 * atoms.pointCount())
    , weights_(3UL * kColumns * (atoms.pointCount() + kCouples)) {
  places_.reserve(atoms.pointCount());
  points_.reserve(atoms.pointCount() + kCouples);
}

void ModelContacts::Found::take(const Estimate& estimate, Mixture& mixture, std::span<const unsigned char> has) {
  mixture_ = &mixture;
  places_.clear();
  for (std::size_t p = 0; p < has.size(); ++p) {
    const auto force = std::span(estimate.force_N).subspan(3 * p, 3);
    if (!has[p] || (force[0] == 0.0 && force[1] == 0.0 && force[2] == 0.0)) continue;
    std::copy(force.begin(), force.end(), forces_.begin() + 3 * std::ssize(places_));
    places_.push_back(static_cast<int>(p));
  }
  const bool isAll = estimate.patchShare <= 0.5 && !places_.empty();  // else what lies beside the patches
  whole_ = isAll ? &estimate.covariance : nullptr;
  const int patches = isAll ? estimate.patchCount : 0;
  couples_ = std::span(estimate.couple_Nm).first(3 * patches);
  for (std::size_t k = 0; k < couplesAt().size(); ++k) couplesAt_[k] = nearest(estimate.patches[k].patch.place);
}

/// Returns the index in places() that is nearest to a patch.
int ModelContacts::Found::nearest(const PatchPlace& place) const {
  const auto away = [&](int point) { return (atoms_.points.col(point) - Vector3d(place.x_m, place.y_m, 0.0)).norm(); };
  const auto found = std::min_element(places_.begin(), places_.end(), [&](int a, int b) { return away(a) < away(b); });
  return static_cast<int>(found - places_.begin());
}

void ModelContacts::Found::covariances(const double* functionals, std::span<const int> of,
                                       std::array<double, kColumns * kColumns>& result) const {
  weighPoints(functionals, of);
  mixture_->covariance(weights_, points_, result);
}

void ModelContacts::Found::leastVariances(const double* functionals, std::span<const int> of,
                                          std::array<double, kColumns>& variances) const {
  weighPoints(functionals, of);
  mixture_->leastVariances(weights_, points_, variances);
}

/// Sets the weights of the points in functionals.
void ModelContacts::Found::weighPoints(const double* functionals, std::span<const int> of) const {
  constexpr std::ptrdiff_t kNumbers = 3 * kColumns;  // of a place
  points_.clear();
  for (const int i : of) {
    const auto count = static_cast<int>(places_.size());
    const int point = i < count ? places_[i] : atoms_.pointCount() + i - count;
    std::copy_n(functionals + kNumbers * i, kNumbers, weights_.data() + kNumbers * point);
    points_.push_back(point);
  }
}

ModelContacts::ModelContacts(const Atoms& atoms, const sensor::Sensor& sensor, const SystematicPart& systematic)
    : atoms_(atoms)
    , systematic_(systematic)
    , spread_(atoms)
    , found_(atoms)
    , hills_(gridOf(atoms, sensor), atoms.pointCount() + kCouples)
    , has_(atoms.pointCount())
    , share_(has_.size())
    , nearest_(has_.size())
    , part_(has_.size())
    , forces_(3 * has_.size())
    , nodeForces_(3 * atoms.nodeCount())
    , weights_(3 * kColumns * (has_.size() + kCouples)) {
  for (auto& each : ofPatch_) each.resize(forces_.size());
  points_.reserve(has_.size() + kCouples);
}

int ModelContacts::list(const Estimate& estimate, Mixture& mixture, double least_N,
                        std::array<Contact, kMaxContacts>& contacts) {
  if (estimate.patchShare > 0.5) return listPatches(estimate, mixture, least_N, contacts);
  std::fill(has_.begin(), has_.end(), 1);
  found_.take(estimate, mixture, has_);
  if (estimate.evenShare <= 0.5) return listHills(contacts);
  hills_.unite(found_);
  contacts[0] = *describeHill(0, 0.0, 0.0);
  return 1;
}

/// Lists the hill of the highest peak, and those with a surety above Hills::kLeast_deviations; of more than
/// kMaxContacts, those of the highest peaks.
int ModelContacts::listHills(std::array<Contact, kMaxContacts>& contacts) {
  hills_.divide(found_);
  std::size_t count = 0;
  for (int hill = 0; hill < hills_.count() && count < kMaxContacts; ++hill) {
    if (!hills_.stands(hill)) continue;
    const double least = count == 0 ? 0.0 : Hills::kLeast_deviations;
    if (const auto contact = describeHill(hill, least, 0.0)) contacts[count++] = *contact;
  }
  Hills::sort(std::span(contacts).first(count));
  return static_cast<int>(count);
}

std::optional<Contact> ModelContacts::describeHill(int hill, double least_deviations, double least_N) {
  std::optional<Contact> contact = hills_.describe(found_, hill, least_deviations, least_N);
  if (!contact) return contact;
  std::fill(forces_.begin(), forces_.end(), 0.0);
  for (std::size_t i = 0; i < found_.places().size(); ++i) {
    if (hills_.hillOf(static_cast<int>(i)) != hill) continue;
    std::copy_n(found_.forces_N().data() + 3 * i, 3, forces_.data() + 3 * std::ptrdiff_t{found_.places()[i]});
  }
  addSystematic(*contact);
  return contact;
}

/// Adds the systematic part. forces_: those of the contact.
void ModelContacts::addSystematic(Contact& contact) {
  const Vector3d at(contact.position_m[0], contact.position_m[1], contact.positionZ_m);
  std::array<double, 6> wrench{};
  Vector6::Map(wrench.data()) = toPoint(-at) * wrenchOf(contact);
  addAtNodes(atoms_, forces_, nodeForces_);
  contact.systematic = covarianceAt(at, systematic_.covariance(wrench, nodeForces_));
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
    if (first || Hills::surety(contact) > Hills::kLeast_deviations) contacts[count++] = contact;
  }
  Hills::sort(std::span(contacts).first(count));
  return count;
}

/// Finds the patches' forces at the points, the patch that each point is nearest to, and those that lie beside all.
void ModelContacts::share(const Estimate& estimate) {
  for (int k = 0; k < estimate.patchCount; ++k) {
    const RoundPatch& patch = estimate.patches[k].patch;
    spread_.divide(patch.place, true, share_);
    double* const forces = ofPatch_[k].data();
    for (std::size_t p = 0; p < share_.size(); ++p)
      Vector3d::Map(forces + 3 * p) = spread_.force(patch.load, share_, p);
  }
  for (std::size_t p = 0; p < has_.size(); ++p) {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < estimate.patchCount; ++k) {
      const PatchPlace& place = estimate.patches[k].patch.place;
      const Vector2d away = atoms_.points.col(static_cast<Index>(p)).head<2>() - Vector2d(place.x_m, place.y_m);
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
    if (has_[p]) sum += forceOf(estimate, static_cast<Index>(p)).norm();
  }
  int count = 0;
  if (sum > least_N) {
    found_.take(estimate, mixture, has_);
    hills_.divide(found_);
  }
  std::fill(has_.begin(), has_.end(), 0);
  if (sum <= least_N) return 0;
  for (int hill = 0; hill < hills_.count() && count < kMaxContacts - kMost; ++hill) {
    if (!hills_.stands(hill)) continue;
    const auto contact = describeHill(hill, Hills::kLeast_deviations, least_N);
    if (!contact) continue;
    contacts[count++] = *contact;
    for (std::size_t i = 0; i < found_.places().size(); ++i) {
      if (hills_.hillOf(static_cast<int>(i)) == hill) has_[found_.places()[i]] = 1;
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
    Vector3d rest = forceOf(estimate, static_cast<Index>(p)), own = Vector3d::Zero();
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
    moment += atoms_.points.col(static_cast<Index>(p)).cross(Vector3d::Map(forces_.data() + 3 * p));
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
    centre += along.dot(Vector3d::Map(forces_.data() + 3 * p)) * atoms_.points.col(static_cast<Index>(p)).head<2>();
  }
  points_.clear();
  for (std::size_t p = 0; p < has_.size(); ++p) {
    if (part_[p] == 0.0) continue;
    points_.push_back(static_cast<int>(p));
    const Vector3d at = atoms_.points.col(static_cast<Index>(p));
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
