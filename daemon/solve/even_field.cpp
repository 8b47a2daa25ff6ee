#include "daemon/solve/even_field.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Reaches over which the magnitudes of the forces are averaged: for p, sharp, and for t, about the markers' depth
/// [pitches].
constexpr double kNear = 2.0 / 3.0, kAround = 2.0;
/// Where the edge is, half of its width, and how far it is free [t].
constexpr double kEdge = 0.45, kHalfWidth = 0.15, kFreeEdge = 0.15;
/// Prior deviation of the pressure, as a multiple of the footprint.
constexpr double kFreePressure = 3.0;
/// The roughness, of EvenField::kRoughness, of the first solution.
constexpr int kFirst = 1;
/// Log evidence by which a roughness must be less likely than the one before, for those beyond it to be left out.
constexpr double kFarLess = 25.0;
/// Log evidence that the first solution may lack without being hopeless. The others may gain more, where many forces
/// are misread as an even contact: then it is left as well (docs/decisions/0037-one-patch-first.md).
constexpr double kHopeless = 100.0;
/// Pressure around a point beneath which nothing is, as a share of the largest.
constexpr double kFaintest = 1e-9;

}  // namespace

EvenField::EvenField(const Factors& factors, const Atoms& atoms, Selection& selection, Roughness& roughness)
    : factors_(factors)
    , atoms_(atoms)
    , selection_(selection)
    , roughness_(roughness)
    , near_(atoms, kNear * atoms.pitch_m)
    , around_(atoms, kAround * atoms.pitch_m)
    , extra_(factors, atoms, kUnknowns)
    , part_(atoms.pointCount())
    , force_(atoms.pointCount())
    , pressure_(atoms.pointCount())
    , level_(atoms.pointCount())
    , footprint_(atoms.pointCount())
    , smaller_(atoms.pointCount())
    , larger_(atoms.pointCount())
    , even_(3 * atoms.pointCount())
    , forces_(3 * atoms.count())
    , column_(factors.influence.stride()) {
  open_.reserve(part_.size());
  for (std::size_t i = 0; i < kRoughness.size(); ++i) solutions_.emplace_back(factors, atoms, kMostAtoms, kUnknowns);
  rows_.reserve(part_.size());
  coefficients_.reserve(part_.size());
}

bool EvenField::solve(const Displacements& picture, AtomProducts& products, std::span<const double> forces_N,
                      double degrees, double least) {
  fieldDegrees_ = degrees;
  draw(forces_N);
  setUnknowns(picture);
  if (!fit(picture, products, kFirst)) return false;
  if (posterior(kFirst).logEvidence() - kOptimism * degrees < least - kHopeless) return false;
  pointForces_N(kFirst, even_);
  draw(even_);
  setUnknowns(picture);
  constexpr auto kCount = static_cast<int>(kRoughness.size());
  for (count_ = 0; count_ < kCount;) {
    const auto i = static_cast<std::size_t>(count_);
    if (!fit(picture, products, count_)) return false;
    logEvidence_[i] = worth(count_++);
    if (i > 0 && logEvidence_[i] < logEvidence_[i - 1] - kFarLess) break;
  }
  return true;
}

/// Computes the footprint and the directions of what acts on it.
void EvenField::draw(std::span<const double> forces_N) {
  Block along = Block::Zero();
  for (Index p = 0; p < force_.size(); ++p) {
    const auto force = Vector3d::Map(forces_N.data() + 3 * p);
    force_[p] = force.norm();
    if (force_[p] > 0.0) along += force * force.transpose() / force_[p];
  }
  assert(along.trace() > 0.0);
  omega_ = directions(along);
  near_.average(force_, pressure_);
  around_.average(pressure_, level_);
  const double faintest = kFaintest * pressure_.maxCoeff();
  footprint_ = pressure_.cwiseAbs2();
  around_.average(footprint_, larger_);
  level_ = larger_.array() / (level_.array() + faintest);
  drawFootprint(kEdge, footprint_);
  drawFootprint(kEdge + kFreeEdge, smaller_);
  drawFootprint(kEdge - kFreeEdge, larger_);
  keepLargestPart();
}

void EvenField::drawFootprint(double edge, VectorXd& footprint) const {
  for (Index p = 0; p < footprint.size(); ++p) {
    const double above = pressure_[p] - (edge - kHalfWidth) * level_[p];
    footprint[p] = std::clamp(above / (2.0 * kHalfWidth), 0.0, level_[p]);
  }
}

/// Keeps the connected part of the footprint with the most force; of the larger one the points next to it, too.
void EvenField::keepLargestPart() {
  std::fill(part_.begin(), part_.end(), -1);
  int largest = -1;
  double most = 0.0;
  for (int first = 0; first < atoms_.pointCount(); ++first) {
    double sum = 0.0;
    const auto take = [&](int point) {
      if (part_[point] >= 0 || footprint_[point] == 0.0) return;
      part_[point] = first;
      sum += footprint_[point];
      open_.push_back(point);
    };
    take(first);
    while (!open_.empty()) {
      const int point = open_.back();
      open_.pop_back();
      eachAround(point, atoms_.columns, atoms_.rows, take);
    }
    if (sum <= most) continue;
    most = sum;
    largest = first;
  }
  for (int point = 0; point < atoms_.pointCount(); ++point) {
    const auto isOf = [&](int other) { return part_[other] == largest; };
    bool isNear = false;
    eachAround(point, atoms_.columns, atoms_.rows, [&](int other) { isNear = isNear || isOf(other); });
    if (!isOf(point)) footprint_[point] = smaller_[point] = 0.0;
    if (!isNear) larger_[point] = 0.0;
  }
}

void EvenField::setUnknowns(const Displacements& picture) {
  extra_.begin(kUnknowns);
  for (int unknown = 0; unknown < kUnknowns; ++unknown) {
    const bool isPressure = unknown < 3;
    const std::size_t axis = unknown % 3;
    const auto forces = extra_.pointForces_N(unknown);
    rows_.clear();
    coefficients_.clear();
    for (Index p = 0; p < footprint_.size(); ++p) {
      const double force = isPressure ? kFreePressure * footprint_[p] : 0.5 * (larger_[p] - smaller_[p]);
      if (force == 0.0) continue;
      forces[3 * p + axis] = force;
      rows_.push_back(static_cast<int>(3 * p) + static_cast<int>(axis));
      coefficients_.push_back(static_cast<float>(force));
      extra_.wrench(unknown) += force * unitWrenches(atoms_.points.col(p)).col(static_cast<Index>(axis));
    }
    std::fill_n(column_.data(), column_.size(), 0.0);
    addRows(factors_.influence, rows_, coefficients_, column_.data());
    for (const int coordinate : picture.missing) column_.data()[coordinate] = 0.0;
    extra_.setDisplacement(unknown, column_.data(), 1.0);
  }
  extra_.multiply(picture);
}

/// Solves with roughness `i`.
bool EvenField::fit(const Displacements& picture, AtomProducts& products, int i) {
  auto& [chosen, posterior] = solutions_[i];
  for (Index p = 0; p < footprint_.size(); ++p) Vector3d::Map(even_.data() + 3 * p) = Vector3d(0, 0, footprint_[p]);
  selection_.choose(roughness_.of(even_, kRoughness[i]), kMostAtoms, false, picture.noise_px, chosen);
  chosen.covariance_N2.clear();
  for (const double gamma : chosen.gamma_N2) chosen.covariance_N2.emplace_back(gamma * omega_);
  return posterior.fit(picture, products, chosen, &extra_);
}

double EvenField::worth(int i) {
  auto& [chosen, posterior] = solutions_[i];
  double degrees = kUnknowns;
  for (const double each : posterior.known()) degrees += each;
  std::array<double, kUnknowns * kUnknowns> covariance{};
  posterior.extraCovariance(covariance);
  for (std::size_t k = 0; k < kUnknowns; ++k) degrees -= covariance[(kUnknowns + 1) * k];
  return posterior.logEvidence() - kOptimism * std::max(degrees, fieldDegrees_) -
         std::log(static_cast<double>(kRoughness.size()));
}

void EvenField::pointForces_N(int i, std::span<double> forces) {
  posterior(i).allForces_N(forces_);
  addUp(atoms_, forces_, forces);
  for (int unknown = 0; unknown < kUnknowns; ++unknown) {
    const double times = posterior(i).extra()[unknown];
    const auto unit = std::as_const(extra_).pointForces_N(unknown);
    for (std::size_t f = unknown % 3; f < forces.size(); f += 3) forces[f] += times * unit[f];
  }
}

}  // namespace tractiond::solve
