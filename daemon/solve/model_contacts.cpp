#include "daemon/solve/model_contacts.h"

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

auto forceOf(const Estimate& estimate, Index point) {
  return Vector3d::Map(estimate.force_N.data() + 3 * point);
}

}  // namespace

ModelContacts::Found::Found(int points)
    : forces_(3 * static_cast<std::size_t>(points))
    , weights_(kColumns * forces_.size()) {
  places_.reserve(static_cast<std::size_t>(points));
  points_.reserve(static_cast<std::size_t>(points));
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
}

void ModelContacts::Found::covariances(const double* functionals, std::span<const int> of,
                                       std::array<double, kColumns * kColumns>& result) const {
  constexpr std::ptrdiff_t kNumbers = 3 * kColumns;  // of a place
  points_.clear();
  for (const int i : of) {
    const int point = places_[static_cast<std::size_t>(i)];
    std::copy_n(functionals + kNumbers * i, kNumbers, weights_.data() + kNumbers * point);
    points_.push_back(point);
  }
  mixture_->covariance(weights_, points_, result);
}

ModelContacts::ModelContacts(const Atoms& atoms, const sensor::Sensor& sensor)
    : atoms_(atoms)
    , spread_(atoms)
    , found_(atoms.pointCount())
    , hills_(gridOf(atoms, sensor), atoms.pointCount())
    , has_(static_cast<std::size_t>(atoms.pointCount()))
    , nearest_(has_.size())
    , part_(has_.size())
    , weights_(3 * kColumns * has_.size())
    , forces_(3 * has_.size()) {
  for (auto& each : share_) each.resize(has_.size());
  points_.reserve(has_.size());
}

int ModelContacts::list(const Estimate& estimate, Mixture& mixture, double least_N,
                        std::array<Contact, kMaxContacts>& contacts) {
  if (estimate.patchShare > 0.5) return listPatches(estimate, mixture, least_N, contacts);
  std::fill(has_.begin(), has_.end(), 1);
  found_.take(estimate, mixture, has_);
  if (estimate.evenShare <= 0.5) return hills_.list(found_, contacts);
  hills_.unite(found_);
  contacts[0] = hills_.describe(found_, 0);
  return 1;
}

int ModelContacts::listPatches(const Estimate& estimate, Mixture& mixture, double least_N,
                               std::array<Contact, kMaxContacts>& contacts) {
  static_assert(kMost <= kMaxContacts);
  share(estimate);
  std::array<Contact, kMost> patched;
  int patchedCount = 0;
  int count = listBeside(estimate, mixture, least_N, contacts);
  for (int k = 0; k < estimate.patchCount; ++k) {
    if (estimate.patches[static_cast<std::size_t>(k)].contact == k) {
      patched[static_cast<std::size_t>(patchedCount++)] = describe(estimate, mixture, k);
    }
  }
  const auto ofPatches = std::span(patched).first(static_cast<std::size_t>(patchedCount));
  Hills::sort(ofPatches);
  for (const Contact& contact : ofPatches) {
    const bool first = &contact == ofPatches.data();
    if (first || Hills::surety(contact) > Hills::kLeast_deviations)
      contacts[static_cast<std::size_t>(count++)] = contact;
  }
  Hills::sort(std::span(contacts).first(static_cast<std::size_t>(count)));
  return count;
}

/// Finds the patches' shares of the points, the patch that each point is nearest to, and those that lie beside all.
void ModelContacts::share(const Estimate& estimate) {
  for (int k = 0; k < estimate.patchCount; ++k) {
    spread_.divide(estimate.patches[static_cast<std::size_t>(k)].patch.place, true,
                   share_[static_cast<std::size_t>(k)]);
  }
  for (std::size_t p = 0; p < has_.size(); ++p) {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < estimate.patchCount; ++k) {
      const PatchPlace& place = estimate.patches[static_cast<std::size_t>(k)].patch.place;
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
    Contact& contact = contacts[static_cast<std::size_t>(count)] = hills_.describe(found_, hill);
    if (Vector3d::Map(contact.force_N.data()).norm() < least_N || Hills::surety(contact) < Hills::kLeast_deviations) {
      continue;
    }
    ++count;
    for (std::size_t i = 0; i < found_.places().size(); ++i) {
      if (hills_.hillOf(static_cast<int>(i)) == hill) has_[static_cast<std::size_t>(found_.places()[i])] = 1;
    }
  }
  return count;
}

/// Finds the parts that a contact of patches has in the forces of the points, and these forces. Returns their sum.
Vector3d ModelContacts::gather(const Estimate& estimate, int contact) {
  const auto patches = std::span(estimate.patches).first(static_cast<std::size_t>(estimate.patchCount));
  double nearest_N = 0.0;
  for (const FoundPatch& each : patches) nearest_N += kShareOfNearest * each.patch.load.head<3>().norm();
  Vector3d sum = Vector3d::Zero();
  for (std::size_t p = 0; p < has_.size(); ++p) {
    // The patches' own forces are known; what is there besides is divided by their strength.
    double own_N = 0.0, all_N = nearest_N;
    Vector3d rest = forceOf(estimate, static_cast<Index>(p)), own = Vector3d::Zero();
    for (std::size_t k = 0; k < patches.size(); ++k) {
      const Vector3d force = share_[k][p] * patches[k].patch.load.head<3>();
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

/// Describes a contact of patches: their forces, and its part of what is found besides.
Contact ModelContacts::describe(const Estimate& estimate, Mixture& mixture, int contact) {
  const Vector3d force = gather(estimate, contact);
  // Centres of what presses, and of all along the force.
  const std::array<Vector3d, 2> along = {Vector3d::UnitZ(), force.normalized()};
  std::array<Vector2d, 2> centre = {Vector2d::Zero(), Vector2d::Zero()};
  for (std::size_t i = 0; i < along.size(); ++i) {
    for (std::size_t p = 0; p < has_.size(); ++p) {
      const double share = along[i].dot(Vector3d::Map(forces_.data() + 3 * p)) / along[i].dot(force);
      centre[i] += share * atoms_.points.col(static_cast<Index>(p)).head<2>();
    }
  }
  // Functionals: the force, then these centres.
  points_.clear();
  for (std::size_t p = 0; p < has_.size(); ++p) {
    if (part_[p] == 0.0) continue;
    points_.push_back(static_cast<int>(p));
    const Vector2d at = atoms_.points.col(static_cast<Index>(p)).head<2>();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double* const weights = weights_.data() + kColumns * (3 * p + axis);
      std::fill_n(weights, kColumns, 0.0);
      weights[axis] = part_[p];
      for (std::size_t i = 0; i < along.size(); ++i) {
        Vector2d::Map(weights + 3 + 2 * i) =
            part_[p] * along[i][static_cast<Index>(axis)] / along[i].dot(force) * (at - centre[i]);
      }
    }
  }
  std::array<double, kColumns * kColumns> covariances{};
  mixture.covariance(weights_, points_, covariances);
  const auto deviation = [&](std::size_t i) { return std::sqrt(covariances[(kColumns + 1) * i]); };
  Contact result;
  Vector3d::Map(result.force_N.data()) = force;
  for (std::size_t axis = 0; axis < 3; ++axis) result.forceDeviation_N[axis] = deviation(axis);
  const std::size_t which = force.z() > Hills::kLeast_deviations * deviation(2) ? 0 : 1;
  Vector2d::Map(result.position_m.data()) = centre[which];
  for (std::size_t axis = 0; axis < 2; ++axis) result.positionDeviation_m[axis] = deviation(3 + 2 * which + axis);
  setArea(estimate, contact, result);
  return result;
}

/// Gives the area of a contact of patches: of several, the squares of their pressures add up.
void ModelContacts::setArea(const Estimate& estimate, int contact, Contact& result) {
  double sum = 0.0, squares = 0.0, doubt = 0.0;
  for (const FoundPatch& found : std::span(estimate.patches).first(static_cast<std::size_t>(estimate.patchCount))) {
    if (found.contact != contact) continue;
    const double deviation = 4.0 * std::numbers::pi * std::sqrt(found.covariance(6, 6));
    const double area = std::max(4.0 * std::numbers::pi * found.patch.place.spread_m2, deviation);
    const double force = found.patch.load.head<3>().norm();
    sum += force;
    squares += square(force) / area;
    doubt += square(square(force / area) * deviation);
  }
  result.area_m2 = square(sum) / squares;
  result.areaDeviation_m2 = square(result.area_m2 / sum) * std::sqrt(doubt);
}

}  // namespace tractiond::solve
