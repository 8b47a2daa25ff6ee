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

Hills::Hills(const Atoms& atoms, const sensor::Sensor& sensor)
    : atoms_(atoms)
    , columns_(sensor.body ? sensor.nodes.columns : atoms.columns)
    , rows_(sensor.body ? sensor.nodes.rows : atoms.rows)
    , normals_(3, atoms.pointCount())
    , areas_(atoms.pointCount())
    , indexAt_(atoms.pointCount(), -1)
    , functionals_(3 * kColumns * (atoms.pointCount() + kCouples))
    , isUsed_(atoms.pointCount() + kCouples) {
  const sensor::Points normals = sensor::nodeNormals(sensor);
  const Eigen::VectorXd areas = sensor::nodeAreas(sensor);
  for (int p = 0; p < atoms.pointCount(); ++p) {
    normals_.col(p) = normals.col(atoms.nodeOf(p));
    areas_[p] = areas[atoms.nodeOf(p)];
  }
  for (auto* each : {&places_, &order_, &hill_, &peak_, &parent_, &members_, &used_}) each->reserve(isUsed_.size());
  for (auto* each : {&forces_, &magnitude_}) each->reserve(3 * isUsed_.size());
  apart_.reserve(isUsed_.size());
  valleys_.reserve(2 * indexAt_.size());
}

void Hills::take(const Estimate& estimate, Mixture& mixture, std::span<const unsigned char> has) {
  mixture_ = &mixture;
  places_.clear();
  forces_.clear();
  magnitude_.clear();
  for (std::size_t p = 0; p < has.size(); ++p) {
    const auto f = std::span(estimate.force_N).subspan(3 * p, 3);
    if (!has[p] || (f[0] == 0.0 && f[1] == 0.0 && f[2] == 0.0)) continue;
    places_.push_back(static_cast<int>(p));
    forces_.insert(forces_.end(), f.begin(), f.end());
    magnitude_.push_back(std::sqrt(square(f[0]) + square(f[1]) + square(f[2])));
  }
  const bool isAll = estimate.patchShare <= 0.5 && !places_.empty();  // else what lies beside the patches
  whole_ = isAll ? &estimate.covariance : nullptr;
  const int patches = isAll ? estimate.patchCount : 0;
  couples_ = std::span(estimate.couple_Nm).first(3 * patches);
  for (int k = 0; k < patches; ++k) couplesAt_[k] = nearest(estimate.patches[k].patch.place);
}

/// Returns the index in places_ that is nearest to a patch.
int Hills::nearest(const PatchPlace& place) const {
  const auto away = [&](int point) {
    return (atoms_.points.col(point) - Eigen::Vector3d(place.x_m, place.y_m, 0.0)).norm();
  };
  const auto found = std::min_element(places_.begin(), places_.end(), [&](int a, int b) { return away(a) < away(b); });
  return static_cast<int>(found - places_.begin());
}

int Hills::hillOf(int index) const {
  int hill = hill_[index];
  while (parent_[hill] != hill) hill = parent_[hill];
  return hill;
}

void Hills::forcesOf(int hill, std::span<double> forces) const {
  std::fill(forces.begin(), forces.end(), 0.0);
  for (int i = 0; i < std::ssize(places_); ++i) {
    if (hillOf(i) == hill) std::copy_n(forces_.begin() + 3 * i, 3, forces.begin() + 3 * places_[i]);
  }
}

/// Returns the covariance of the functionals.
std::array<double, kColumns * kColumns> Hills::covariances() {
  std::array<double, kColumns * kColumns> result{};
  mixture_->covariance({functionals_.data(), functionals_.size()}, used_, result);
  return result;
}

/// Returns lower bounds of their variances, in a small part of the time.
std::array<double, kColumns> Hills::leastVariances() {
  std::array<double, kColumns> result{};
  mixture_->leastVariances({functionals_.data(), functionals_.size()}, used_, result);
  return result;
}

/// The forces along `direction` in a strip across the line from place `from` (unit step `along`, in pitches), at a
/// distance `at` on that line: places count linearly less up to a pitch from it. Adds `factor` times that functional to
/// one of the functionals.
double Hills::strip(int from, const Eigen::Vector2d& along, double at, const Eigen::Vector3d& direction, double factor,
                    int column) {
  const int row0 = places_[from] / columns_, column0 = places_[from] % columns_;
  constexpr int kWindow = 2;  // holds every place that counts, from the one nearest to `at`
  static_assert((kWindow + 0.5) * (kWindow + 0.5) > 1.0 + kHalfWidth * kHalfWidth);
  const int row = row0 + static_cast<int>(std::lround(along.y() * at));
  const int middle = column0 + static_cast<int>(std::lround(along.x() * at));
  double sum = 0.0;
  for (int r = std::max(0, row - kWindow); r <= std::min(rows_ - 1, row + kWindow); ++r) {
    for (int c = std::max(0, middle - kWindow); c <= std::min(columns_ - 1, middle + kWindow); ++c) {
      const int j = indexAt_[r * columns_ + c];
      if (j < 0) continue;
      const Eigen::Vector2d offset(c - column0, r - row0);
      const double weight = 1.0 - std::abs(along.dot(offset) - at);
      if (weight <= 0.0 || std::abs(along.x() * offset.y() - along.y() * offset.x()) > kHalfWidth) continue;
      for (int axis = 0; axis < 3; ++axis) sum += weight * direction[axis] * forces_[3 * j + axis];
      if (factor == 0.0) continue;
      double* const functionals = functionalsOf(places_[j]) + column;
      for (int axis = 0; axis < 3; ++axis) functionals[kColumns * axis] += factor * weight * direction[axis];
    }
  }
  return sum;
}

/// Returns the coefficients of a point or couple in the functionals, x, y, z after each other, and notes that they are
/// used.
double* Hills::functionalsOf(int point) {
  if (isUsed_[point] == 0) used_.push_back(point);
  isUsed_[point] = 1;
  return functionals_.data() + 3 * kColumns * point;
}

void Hills::clearFunctionals() {
  for (const int point : used_) {
    std::fill_n(functionals_.data() + 3 * kColumns * point, 3 * kColumns, 0.0);
    isUsed_[point] = 0;
  }
  used_.clear();
}

bool Hills::isValleyBetween(int lower, int higher) {
  const Eigen::Vector3d direction = (force(lower) + force(higher)).normalized();
  Eigen::Vector2d along(places_[higher] % columns_ - places_[lower] % columns_,
                        places_[higher] / columns_ - places_[lower] / columns_);
  const double length = along.norm();
  if (length < 1.5) return false;  // neighbours
  along /= length;
  const auto height = [&](double at, double factor, int column) {
    return strip(lower, along, at, direction, factor, column);
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
    const auto least = leastVariances();
    bool possible = false;
    for (std::size_t k = 0; k < count; ++k) possible = possible || isSure(k, least[k]);
    if (!possible) continue;
    const auto all = covariances();
    for (std::size_t k = 0; k < count; ++k) {
      if (isSure(k, all[(kColumns + 1) * k])) return true;
    }
  }
  return false;
}

void Hills::divide() {
  const int count = static_cast<int>(places_.size());
  order_.clear();
  for (int i = 0; i < count; ++i) {
    order_.push_back(i);
    indexAt_[places_[i]] = i;
  }
  std::sort(order_.begin(), order_.end(), [this](int a, int b) { return magnitude_[a] > magnitude_[b]; });

  hill_.assign(count, -1);
  peak_.clear();
  parent_.clear();
  apart_.clear();
  for (const int i : order_) {
    eachAround(places_[i], columns_, rows_, [&](int point) {
      const int neighbour = indexAt_[point];
      if (neighbour < 0 || neighbour == i || hill_[neighbour] < 0) return;
      const int other = hillOf(neighbour);
      if (hill_[i] < 0) hill_[i] = other;
      const int own = hillOf(i);
      if (own == other) return;
      const bool ownIsHigher = magnitude_[peak_[own]] > magnitude_[peak_[other]];
      const int higher = ownIsHigher ? own : other, lower = ownIsHigher ? other : own;
      if (std::find(apart_.begin(), apart_.end(), std::pair{lower, higher}) != apart_.end()) return;
      if (isValleyBetween(peak_[lower], peak_[higher])) {
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
  for (const int point : places_) indexAt_[point] = -1;
}

void Hills::unite() {
  hill_.assign(magnitude_.size(), 0);
  parent_.assign(1, 0);
  peak_.assign(1, static_cast<int>(std::max_element(magnitude_.begin(), magnitude_.end()) - magnitude_.begin()));
}

std::optional<Contact> Hills::describe(int hill, double least_deviations, double least_N) {
  Contact contact;
  double sum = 0.0, squares = 0.0;  // of the forces; squares by area
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), whole = normal, moment = normal;
  members_.clear();
  for (int i = 0; i < std::ssize(places_); ++i) {
    if (hillOf(i) != hill) continue;
    members_.push_back(i);
    whole += force(i);
    moment += position(i).cross(force(i));
    sum += magnitude_[i];
    squares += square(magnitude_[i]) / areas_[places_[i]];
    normal += magnitude_[i] * normals_.col(places_[i]);
  }
  if (whole.norm() < least_N || isFaint(hill, whole, least_deviations)) return std::nullopt;
  normal.normalize();
  contact.area_m2 = square(sum) / squares;
  for (std::size_t k = 0; k < couples_.size() / 3; ++k) {
    if (hillOf(couplesAt_[k]) == hill) moment += Eigen::Vector3d::Map(couples_.data() + 3 * k);
  }
  const WrenchCovariance noise = wrenchNoise(hill);
  setWrench(whole, moment, noise, Eigen::Vector3d::Zero(), contact);
  if (significance(contact) < least_deviations) return std::nullopt;

  // The centre of what presses, or, where nothing does, of all forces along their sum.
  const Eigen::Vector3d deviations(std::sqrt(noise[0]), std::sqrt(noise[7]), std::sqrt(noise[14]));
  const bool presses = normal.dot(whole) > kLeast_deviations * normal.cwiseProduct(deviations).norm();
  const Eigen::Vector3d along = presses ? normal : whole.normalized();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const int i : members_) centre += along.dot(force(i)) / along.dot(whole) * position(i);
  setWrench(whole, moment, noise, centre, contact);

  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const int i : members_) {
    const Eigen::Vector2d away = (position(i) - centre).head<2>();
    moments += along.dot(force(i)) / along.dot(whole) * away * away.transpose();
  }
  constexpr double kEven = 1.0 / 12.0;  // second moment of an even pressure on a square
  const Ellipse ellipse(moments, kEven * areas_[places_[peak_[hill]]]);

  // Functionals: the numbers of the ellipse, the centre.
  clearFunctionals();
  for (const int i : members_) {
    const double ofArea = 2.0 * contact.area_m2 * (1.0 / sum - magnitude_[i] / areas_[places_[i]] / squares);
    const Eigen::Vector2d away = (position(i) - centre).head<2>();
    const Eigen::Vector3d stretch = ellipse.unit(away) - Eigen::Vector3d(ellipse.moments[0], ellipse.moments[1], 0.0);
    for (int axis = 0; axis < 3; ++axis) {
      double* const functionals = functionalsOf(places_[i]) + kColumns * axis;
      functionals[0] = ofArea * forces_[3 * i + axis] / magnitude_[i];
      Eigen::Vector3d::Map(functionals + 1) = along[axis] / along.dot(whole) * stretch;
      Eigen::Vector2d::Map(functionals + Ellipse::kNumbers) = along[axis] / along.dot(whole) * away;
    }
  }
  const auto all = covariances();
  const auto covariance = Eigen::Matrix<double, kColumns, kColumns>::Map(all.data());
  setShape(ellipse, covariance.topLeftCorner<Ellipse::kNumbers, Ellipse::kNumbers>(), contact);
  for (int axis = 0; axis < 2; ++axis) {
    const int number = Ellipse::kNumbers + axis;
    contact.positionDeviation_m[axis] = std::sqrt(covariance(number, number));
  }
  return contact;
}

/// Returns whether the force of members_ is below a significance() even by the least that its variances can be.
bool Hills::isFaint(int hill, const Eigen::Vector3d& whole, double least_deviations) {
  if (least_deviations == 0.0) return false;
  setWrenches(hill);
  const auto least = leastVariances();
  return (whole.array().square() < square(least_deviations) * Eigen::Array3d::Map(least.data())).all();
}

/// Sets the functionals that are the wrench of members_ about the origin.
void Hills::setWrenches(int hill) {
  clearFunctionals();
  for (const int i : members_) writeWrenches(position(i), 1.0, functionalsOf(places_[i]), kColumns);
  for (std::size_t k = 0; k < couples_.size() / 3; ++k) {
    if (hillOf(couplesAt_[k]) != hill) continue;
    double* const functionals = functionalsOf(atoms_.pointCount() + static_cast<int>(k));
    for (int axis = 0; axis < 3; ++axis) functionals[kColumns * axis + 3 + axis] = 1.0;
  }
}

/// Returns the covariance of the wrench of members_ about the origin.
WrenchCovariance Hills::wrenchNoise(int hill) {
  if (whole_ != nullptr && members_.size() == places_.size()) return *whole_;
  setWrenches(hill);
  return firstSix(covariances());
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

double Hills::significance(const Contact& contact) {
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
