#include "daemon/solve/missing_markers.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {

namespace {

/// Number of elements of a lower triangle.
std::size_t packed(std::size_t rows) {
  return rows * (rows + 1) / 2;
}

}  // namespace

MissingMarkers::MissingMarkers(const Inverse& inverse)
    : inverse_(inverse)
    , listed_(static_cast<std::size_t>(inverse.coordinateCount() / 2), 0)
    , factor_(std::make_unique_for_overwrite<double[]>(packed(2 * listed_.size()))) {
  coordinates_.reserve(2 * listed_.size());
  waiting_.reserve(listed_.size());
}

std::span<const double> MissingMarkers::factor() const {
  return {factor_.get(), packed(coordinates_.size())};
}

bool MissingMarkers::update(std::span<const std::uint8_t> valid) {
  assert(valid.size() == listed_.size());

  // Up to the first marker that is back the factor stays; those behind it wait to be appended again, then the new ones.
  std::size_t kept = 0;
  while (kept < coordinates_.size() && valid[coordinates_[kept] / 2] == 0) kept += 2;
  waiting_.clear();
  for (std::size_t i = kept; i < coordinates_.size(); i += 2) {
    const int marker = coordinates_[i] / 2;
    listed_[marker] = valid[marker] == 0 ? 1 : 0;
    if (listed_[marker] != 0) waiting_.push_back(marker);
  }
  for (std::size_t marker = 0; marker < valid.size(); ++marker) {
    if (valid[marker] != 0 || listed_[marker] != 0) continue;
    listed_[marker] = 1;
    waiting_.push_back(static_cast<int>(marker));
  }

  coordinates_.resize(kept);
  for (const int marker : waiting_) {
    if (append(2 * marker) && append(2 * marker + 1)) continue;
    coordinates_.clear();
    std::fill(listed_.begin(), listed_.end(), std::uint8_t{0});
    return false;
  }
  return true;
}

bool MissingMarkers::append(int coordinate) {
  const std::size_t size = coordinates_.size();
  double* const row = factor_.get() + packed(size);
  for (std::size_t i = 0; i < size; ++i) row[i] = -inverse_.hatAt(coordinate, coordinates_[i]);
  solveLower(factor(), static_cast<int>(size), row);
  double pivot = 1.0 - inverse_.hatAt(coordinate, coordinate);
  for (std::size_t i = 0; i < size; ++i) pivot -= row[i] * row[i];
  if (!(pivot > 0.0)) return false;
  row[size] = 1.0 / std::sqrt(pivot);
  coordinates_.push_back(coordinate);
  return true;
}

void MissingMarkers::solve(double* rightHandSide) const {
  const auto size = static_cast<int>(coordinates_.size());
  solveLower(factor(), size, rightHandSide);
  solveLowerTransposed(factor(), size, rightHandSide);
}

}  // namespace tractiond::solve
