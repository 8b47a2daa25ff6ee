// Flooding from the peaks down: the nodes, strongest first, each join the hill of a neighbour that is there already, or
// begin one. Where two hills meet, the lower one stays a contact of its own if the forces fall between the two peaks,
// by more than the noise and by more than a share; otherwise it becomes part of the other. The noise of neighbouring
// nodes is opposed, so sums of a few are known far better than each: the fall is that of sums across the line from peak
// to peak, which takes nothing from the resolution along it.
#include "daemon/solve/hills.h"

#include "daemon/solve/ellipse.h"
#include "daemon/solve/wrench.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

namespace tractiond::solve {
namespace {

/// What separates two contacts: the fall between them in standard deviations, of the lower peak and of the higher one.
constexpr double kFall_deviations = 4.0;
constexpr double kFall_lower = 0.25;
constexpr double kFall_higher = 0.08;

/// Half width of the sums across the line between two peaks [pitches].
constexpr double kHalfWidth = 1.6;

}  // namespace

Hills::Hills(PlaceGrid grid, int mostPlaces)
    : grid_(std::move(grid))
    , indexAt_(grid_.columns * grid_.rows, -1)
    , functionals_(3UL * kColumns * mostPlaces)
    , isUsed_(mostPlaces) {
  for (auto* each : {&order_, &hill_, &peak_, &parent_, &members_, &used_}) each->reserve(isUsed_.size());
  magnitude_.reserve(isUsed_.size());
  apart_.reserve(isUsed_.size());
  valleys_.reserve(2 * indexAt_.size());
}

int Hills::hillOf(int index) const {
  int hill = hill_[index];
  while (parent_[hill] != hill) hill = parent_[hill];
  return hill;
}

/// The forces along `direction` in a strip across the line from place `from` (unit step `along`, in pitches), at a
/// distance `at` on that line: places count linearly less up to a pitch from it. Adds `factor` times that functional to
/// one of the functionals.
double Hills::strip(const SolvedForces& forces, int from, const Eigen::Vector2d& along, double at,
                    const Eigen::Vector3d& direction, double factor, int column) {
  const auto force = forces.forces_N();
  const int row0 = forces.places()[from] / grid_.columns, column0 = forces.places()[from] % grid_.columns;
  constexpr int kWindow = 2;  // holds every place that counts, from the one nearest to `at`
  static_assert((kWindow + 0.5) * (kWindow + 0.5) > 1.0 + kHalfWidth * kHalfWidth);
  const int row = row0 + static_cast<int>(std::lround(along.y() * at));
  const int middle = column0 + static_cast<int>(std::lround(along.x() * at));
  double sum = 0.0;
  for (int r = std::max(0, row - kWindow); r <= std::min(grid_.rows - 1, row + kWindow); ++r) {
    for (int c = std::max(0, middle - kWindow); c <= std::min(grid_.columns - 1, middle + kWindow); ++c) {
      const int j = indexAt_[r * grid_.columns + c];
      if (j < 0) continue;
      const Eigen::Vector2d offset(c - column0, r - row0);
      const double weight = 1.0 - std::abs(along.dot(offset) - at);
      if (weight <= 0.0 || std::abs(along.x() * offset.y() - along.y() * offset.x()) > kHalfWidth) continue;
      for (int axis = 0; axis < 3; ++axis) sum += weight * direction[axis] * force[3 * j + axis];
      if (factor == 0.0) continue;
      double* const functionals = functionalsOf(j) + column;
      for (int axis = 0; axis < 3; ++axis) functionals[kColumns * axis] += factor * weight * direction[axis];
    }
  }
  return sum;
}

/// Returns the coefficients of a place in the functionals, x, y, z after each other, and notes that they are used.
double* Hills::functionalsOf(int index) {
  unsigned char& isUsed = isUsed_[index];
  if (isUsed == 0) used_.push_back(index);
  isUsed = 1;
  return functionals_.data() + std::ptrdiff_t{3 * kColumns} * index;
}

void Hills::clearFunctionals() {
  for (const int index : used_) {
    std::fill_n(functionals_.data() + std::ptrdiff_t{3 * kColumns} * index, 3 * kColumns, 0.0);
    isUsed_[index] = 0;
  }
  used_.clear();
}

bool Hills::isValleyBetween(const SolvedForces& forces, int lower, int higher) {
  const auto places = forces.places();
  const auto force = [&](int i) { return Eigen::Vector3d::Map(forces.forces_N().data() + 3 * i); };
  const Eigen::Vector3d direction = (force(lower) + force(higher)).normalized();
  Eigen::Vector2d along(places[higher] % grid_.columns - places[lower] % grid_.columns,
                        places[higher] / grid_.columns - places[lower] / grid_.columns);
  const double length = along.norm();
  if (length < 1.5) return false;  // neighbours
  along /= length;
  const auto height = [&](double at, double factor, int column) {
    return strip(forces, lower, along, at, direction, factor, column);
  };
  const double low = height(0.0, 0.0, 0), high = height(length, 0.0, 0);
  valleys_.clear();
  for (double at = 0.5; at <= length - 0.5; at += 0.5) {
    const double fall = low - height(at, 0.0, 0);
    if (fall >= kFall_lower * low && fall >= kFall_higher * high) valleys_.emplace_back(fall, at);
  }
  // One evident fall is enough, and one of the deepest is most likely so.
  std::sort(valleys_.begin(), valleys_.end(), std::greater());
  for (std::size_t first = 0; first < valleys_.size(); first += kColumns) {
    const std::size_t count = std::min(std::size_t{kColumns}, valleys_.size() - first);
    clearFunctionals();
    for (std::size_t k = 0; k < count; ++k) {
      height(0.0, 1.0, static_cast<int>(k));
      height(valleys_[first + k].second, -1.0, static_cast<int>(k));
    }
    const auto isSure = [&](std::size_t k, double variance) {
      return valleys_[first + k].first > kFall_deviations * std::sqrt(variance);
    };
    std::array<double, kColumns> least{};
    forces.leastVariances(functionals_.data(), used_, least);
    bool possible = false;
    for (std::size_t k = 0; k < count; ++k) possible = possible || isSure(k, least[k]);
    if (!possible) continue;
    std::array<double, kColumns * kColumns> covariances{};
    forces.covariances(functionals_.data(), used_, covariances);
    for (std::size_t k = 0; k < count; ++k) {
      if (isSure(k, covariances[(kColumns + 1) * k])) return true;
    }
  }
  return false;
}

/// Calls use(j) for the given places next to `place`, the i-th of them.
template <typename Use>
void Hills::around(int place, int i, Use use) const {
  const int row = place / grid_.columns, column = place % grid_.columns;
  for (int r = std::max(0, row - 1); r <= std::min(grid_.rows - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(grid_.columns - 1, column + 1); ++c) {
      const int j = indexAt_[r * grid_.columns + c];
      if (j >= 0 && j != i) use(j);
    }
  }
}

void Hills::measure(const SolvedForces& forces) {
  magnitude_.clear();
  for (std::size_t i = 0; i < forces.places().size(); ++i) {
    const auto f = forces.forces_N().subspan(3 * i, 3);
    magnitude_.push_back(std::sqrt(square(f[0]) + square(f[1]) + square(f[2])));
  }
}

void Hills::divide(const SolvedForces& forces) {
  const auto nodes = forces.places();
  const auto count = static_cast<int>(nodes.size());
  measure(forces);
  order_.clear();
  for (int i = 0; i < count; ++i) {
    order_.push_back(i);
    indexAt_[nodes[i]] = i;
  }
  std::sort(order_.begin(), order_.end(), [this](int a, int b) { return magnitude_[a] > magnitude_[b]; });

  hill_.assign(count, -1);
  peak_.clear();
  parent_.clear();
  apart_.clear();
  for (const int i : order_) {
    around(nodes[i], i, [&](int neighbour) {
      if (hill_[neighbour] < 0) return;
      const int other = hillOf(neighbour);
      if (hill_[i] < 0) hill_[i] = other;
      const int own = hillOf(i);
      if (own == other) return;
      const bool ownIsHigher = magnitude_[peak_[own]] > magnitude_[peak_[other]];
      const int higher = ownIsHigher ? own : other, lower = ownIsHigher ? other : own;
      if (std::find(apart_.begin(), apart_.end(), std::pair{lower, higher}) != apart_.end()) return;
      if (isValleyBetween(forces, peak_[lower], peak_[higher])) {
        apart_.emplace_back(lower, higher);
      } else {
        parent_[lower] = higher;
      }
    });
    if (hill_[i] >= 0) continue;
    hill_[i] = static_cast<int>(peak_.size());
    parent_.push_back(hill_[i]);
    peak_.push_back(i);
  }
  for (const int node : nodes) indexAt_[node] = -1;
}

void Hills::unite(const SolvedForces& forces) {
  measure(forces);
  hill_.assign(magnitude_.size(), 0);
  parent_.assign(1, 0);
  peak_.assign(1, static_cast<int>(std::max_element(magnitude_.begin(), magnitude_.end()) - magnitude_.begin()));
}

std::optional<Contact> Hills::describe(const SolvedForces& solved, int hill, double least_deviations, double least_N) {
  const auto nodes = solved.places();
  const auto forces = solved.forces_N();
  measure(solved);
  Contact contact;
  double sum = 0.0, squares = 0.0;  // of the forces; squares by area
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), force = normal, moment = normal;
  const auto forceOf = [&](int i) { return Eigen::Vector3d::Map(forces.data() + std::ptrdiff_t{3} * i); };
  members_.clear();
  for (int i = 0; i < static_cast<int>(nodes.size()); ++i) {
    if (hillOf(i) != hill) continue;
    members_.push_back(i);
    force += forceOf(i);
    moment += grid_.positions.col(nodes[i]).cross(forceOf(i));
    sum += magnitude_[i];
    squares += square(magnitude_[i]) / grid_.areas[nodes[i]];
    normal += magnitude_[i] * grid_.normals.col(nodes[i]);
  }
  if (force.norm() < least_N || isFaint(solved, hill, force, least_deviations)) return std::nullopt;
  normal.normalize();
  contact.area_m2 = square(sum) / squares;
  for (std::size_t k = 0; k < solved.couplesAt().size(); ++k) {
    if (hillOf(solved.couplesAt()[k]) == hill) moment += Eigen::Vector3d::Map(solved.couples_Nm().data() + 3 * k);
  }
  const WrenchCovariance noise = wrenchNoise(solved, hill);
  setWrench(force, moment, noise, Eigen::Vector3d::Zero(), contact);
  if (surety(contact) < least_deviations) return std::nullopt;

  // The centre of what presses, or, where nothing does, of all forces along their sum.
  const Eigen::Vector3d deviations(std::sqrt(noise[0]), std::sqrt(noise[7]), std::sqrt(noise[14]));
  const bool presses = normal.dot(force) > kLeast_deviations * normal.cwiseProduct(deviations).norm();
  const Eigen::Vector3d along = presses ? normal : force.normalized();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const int i : members_) centre += along.dot(forceOf(i)) / along.dot(force) * grid_.positions.col(nodes[i]);
  setWrench(force, moment, noise, centre, contact);

  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const int i : members_) {
    const Eigen::Vector2d away = (grid_.positions.col(nodes[i]) - centre).head<2>();
    moments += along.dot(forceOf(i)) / along.dot(force) * away * away.transpose();
  }
  constexpr double kEven = 1.0 / 12.0;  // second moment of an even pressure on a square
  const Ellipse ellipse(moments, kEven * grid_.areas[nodes[peak_[hill]]]);

  // Functionals: the numbers of the ellipse, the centre.
  clearFunctionals();
  for (const int i : members_) {
    const double ofArea = 2.0 * contact.area_m2 * (1.0 / sum - magnitude_[i] / grid_.areas[nodes[i]] / squares);
    const Eigen::Vector2d away = (grid_.positions.col(nodes[i]) - centre).head<2>();
    const Eigen::Vector3d stretch = ellipse.unit(away) - Eigen::Vector3d(ellipse.moments[0], ellipse.moments[1], 0.0);
    for (int axis = 0; axis < 3; ++axis) {
      double* const functionals = functionalsOf(i) + kColumns * axis;
      functionals[0] = ofArea * forces[3 * i + axis] / magnitude_[i];
      Eigen::Vector3d::Map(functionals + 1) = along[axis] / along.dot(force) * stretch;
      Eigen::Vector2d::Map(functionals + Ellipse::kNumbers) = along[axis] / along.dot(force) * away;
    }
  }
  std::array<double, kColumns * kColumns> covariances{};
  solved.covariances(functionals_.data(), used_, covariances);
  const auto covariance = Eigen::Matrix<double, kColumns, kColumns>::Map(covariances.data());
  setShape(ellipse, covariance.topLeftCorner<Ellipse::kNumbers, Ellipse::kNumbers>(), contact);
  for (int axis = 0; axis < 2; ++axis) {
    const int number = Ellipse::kNumbers + axis;
    contact.positionDeviation_m[axis] = std::sqrt(covariance(number, number));
  }
  return contact;
}

/// Returns whether the force of members_ is below a surety() even by the least that its variances can be.
bool Hills::isFaint(const SolvedForces& solved, int hill, const Eigen::Vector3d& force, double least_deviations) {
  if (least_deviations == 0.0) return false;
  setWrenches(solved, hill);
  std::array<double, kColumns> least{};
  solved.leastVariances(functionals_.data(), used_, least);
  return (force.array().square() < square(least_deviations) * Eigen::Array3d::Map(least.data())).all();
}

/// Sets the functionals that are the wrench of members_ about the origin.
void Hills::setWrenches(const SolvedForces& solved, int hill) {
  const auto nodes = solved.places();
  clearFunctionals();
  for (const int i : members_) writeWrenches(grid_.positions.col(nodes[i]), 1.0, functionalsOf(i), kColumns);
  for (std::size_t k = 0; k < solved.couplesAt().size(); ++k) {
    if (hillOf(solved.couplesAt()[k]) != hill) continue;
    double* const functionals = functionalsOf(static_cast<int>(nodes.size() + k));
    for (int axis = 0; axis < 3; ++axis) functionals[kColumns * axis + 3 + axis] = 1.0;
  }
}

/// Returns the covariance of the wrench of members_ about the origin.
WrenchCovariance Hills::wrenchNoise(const SolvedForces& solved, int hill) {
  const WrenchCovariance* const whole = solved.wrenchCovariance();
  if (whole != nullptr && members_.size() == solved.places().size()) return *whole;
  setWrenches(solved, hill);
  std::array<double, kColumns * kColumns> covariances{};
  solved.covariances(functionals_.data(), used_, covariances);
  return firstSix(covariances);
}

WrenchCovariance firstSix(std::span<const double> covariances) {
  WrenchCovariance result;
  for (std::size_t i = 0; i < 6; ++i) std::copy_n(covariances.data() + kColumns * i, 6, result.data() + 6 * i);
  return result;
}

void setWrench(const Eigen::Vector3d& force, const Eigen::Vector3d& moment, const WrenchCovariance& noise,
               const Eigen::Vector3d& at, Contact& contact) {
  contact.noise = covarianceAt(at, noise);
  Eigen::Vector2d::Map(contact.position_m.data()) = at.head<2>();
  contact.positionZ_m = at.z();
  Eigen::Vector3d::Map(contact.force_N.data()) = force;
  Eigen::Vector3d::Map(contact.moment_Nm.data()) = moment - at.cross(force);
  for (std::size_t i = 0; i < 3; ++i) contact.forceDeviation_N[i] = std::sqrt(contact.noise[7 * i]);
}

double Hills::surety(const Contact& contact) {
  double deviations = 0.0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    deviations = std::max(deviations, std::abs(contact.force_N[axis]) / contact.forceDeviation_N[axis]);
  }
  return deviations;
}

void Hills::sort(std::span<Contact> contacts) {
  const auto strength = [](const Contact& contact) {
    return square(contact.force_N[0]) + square(contact.force_N[1]) + square(contact.force_N[2]);
  };
  std::sort(contacts.begin(), contacts.end(),
            [&](const Contact& a, const Contact& b) { return strength(a) > strength(b); });
}

}  // namespace tractiond::solve
