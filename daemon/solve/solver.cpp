// Per frame two thin products: the displacements' amplitudes in the singular vectors, c = U'd, streaming the rows of
// the valid coordinates; and the forces f = V S^-1 G c. Missing markers are taken out between the two.
//
// The residual needs no third product. With d completed by the values that leave the missing rows none,
//   |d - U G c|^2 = |d|^2 - |c|^2 + |(1 - G) c|^2,
// because U's columns are orthonormal.
#include "daemon/solve/solver.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace tractiond::solve {
namespace {

double square(double x) {
  return x * x;
}

}  // namespace

Solver::Solver(const Inverse& inverse, const sensor::NodeGrid& nodes, const SolveOptions& options)
    : inverse_(inverse)
    , options_(options)
    , missing_(inverse, static_cast<int>(options.maxMissingFraction * inverse.coordinateCount() / 2))
    , everyMode_(static_cast<std::size_t>(inverse.rank()))
    , amplitudes_(static_cast<std::size_t>(inverse.left.stride()))
    , filtered_(1, inverse.rank())
    , restored_(static_cast<std::size_t>(inverse.coordinateCount()))
    , restoredFloat_(static_cast<std::size_t>(inverse.coordinateCount()))
    , forces_(static_cast<std::size_t>(inverse.right.stride())) {
  assert(3 * nodes.count() == inverse.forceCount());
  for (int row = 0; row < nodes.rows; ++row) {
    for (int column = 0; column < nodes.columns; ++column) {
      const Eigen::Vector3d position = nodes.position(column, row);
      nodes_.push_back({position.x(), position.y()});
    }
  }
  for (const double s : inverse.singularValues) {
    gain_.push_back(square(s) / (square(s) + square(inverse.lambda)));
    inverted_.push_back(gain_.back() / s);
  }
  std::iota(everyMode_.begin(), everyMode_.end(), 0);
  coordinates_.reserve(static_cast<std::size_t>(inverse.coordinateCount()));
  displacements_.reserve(static_cast<std::size_t>(inverse.coordinateCount()));
}

void Solver::solve(const MarkerField& markers, TractionField& field) noexcept {
  assert(2 * markers.valid.size() == static_cast<std::size_t>(inverse_.coordinateCount()));
  assert(markers.displacement_px.size() == static_cast<std::size_t>(inverse_.coordinateCount()));
  assert(field.markers.valid.size() == markers.valid.size());
  assert(field.force_N.size() == static_cast<std::size_t>(inverse_.forceCount()));
  field.markers = markers;
  field.flags = markers.flags;
  field.valid = false;
  if ((markers.flags & kFewMarkers) != 0 || !missing_.update(markers.valid)) {
    field.flags |= kFewMarkers;
    counters_.fewMarkers.add();
  } else {
    field.valid = fit(markers, field.residual_px) && sum(field);
    if (!field.valid) counters_.notFinite.add();
  }
  if (!field.valid) {
    std::fill(field.force_N.begin(), field.force_N.end(), 0.0F);
    field.resultant_N = {};
    field.moment_Nm = {};
    field.centreOfPressure_m = {};
    field.centreOfPressureValid = false;
    field.residual_px = 0.0;
  }
}

bool Solver::fit(const MarkerField& markers, double& residual_px) {
  coordinates_.clear();
  displacements_.clear();
  double squares = 0.0;  // of the displacements, then of the residual
  for (int marker = 0; marker < static_cast<int>(markers.valid.size()); ++marker) {
    if (markers.valid[marker] == 0) continue;
    for (const int coordinate : {2 * marker, 2 * marker + 1}) {
      const float displacement = markers.displacement_px[coordinate];
      coordinates_.push_back(coordinate);
      displacements_.push_back(displacement);
      squares += square(displacement);
    }
  }
  std::fill(amplitudes_.begin(), amplitudes_.end(), 0.0);
  addRows(inverse_.left, coordinates_, displacements_, amplitudes_.data());

  float* const filtered = filtered_.row(0);
  const int rank = inverse_.rank();
  if (const auto missing = missing_.coordinates(); !missing.empty()) {
    for (int i = 0; i < rank; ++i) filtered[i] = static_cast<float>(gain_[i] * amplitudes_[i]);
    multiplyRows(inverse_.left, missing, filtered, restored_.data());
    missing_.solve(restored_.data());
    for (std::size_t i = 0; i < missing.size(); ++i) {
      restoredFloat_[i] = static_cast<float>(restored_[i]);
      squares += square(restored_[i]);
    }
    addRows(inverse_.left, missing, {restoredFloat_.data(), missing.size()}, amplitudes_.data());
  }

  for (int i = 0; i < rank; ++i) {
    squares += square(amplitudes_[i]) * (square(1.0 - gain_[i]) - 1.0);
    filtered[i] = static_cast<float>(inverted_[i] * amplitudes_[i]);
  }
  // Rounding can leave a perfect fit just below zero.
  residual_px = std::sqrt(std::max(squares, 0.0) / static_cast<double>(coordinates_.size()));
  std::fill(forces_.begin(), forces_.end(), 0.0);
  addRows(inverse_.right, everyMode_, {filtered, everyMode_.size()}, forces_.data());
  return std::isfinite(squares) && !coordinates_.empty();
}

bool Solver::sum(TractionField& field) const {
  for (std::size_t i = 0; i < field.force_N.size(); ++i) field.force_N[i] = static_cast<float>(forces_[i]);
  std::array<double, 3> resultant{}, moment{};
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    const auto [x, y] = nodes_[node];
    const double fx = field.force_N[3 * node], fy = field.force_N[3 * node + 1], fz = field.force_N[3 * node + 2];
    resultant[0] += fx;
    resultant[1] += fy;
    resultant[2] += fz;
    moment[0] += y * fz;
    moment[1] -= x * fz;
    moment[2] += x * fy - y * fx;
  }
  field.resultant_N = resultant;
  field.moment_Nm = moment;
  field.centreOfPressureValid = resultant[2] > options_.minPressForCentre_N;
  field.centreOfPressure_m = {};
  if (field.centreOfPressureValid) field.centreOfPressure_m = {-moment[1] / resultant[2], moment[0] / resultant[2]};
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(resultant.begin(), resultant.end(), finite) && std::all_of(moment.begin(), moment.end(), finite);
}

}  // namespace tractiond::solve
