#include "daemon/solve/missing_markers.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {

MissingMarkers::MissingMarkers(const Inverse& inverse, int capacity)
    : inverse_(inverse)
    , capacity_(static_cast<std::size_t>(capacity))
    , listed_(static_cast<std::size_t>(inverse.coordinateCount() / 2), 0) {
  coordinates_.reserve(2 * capacity_);
  waiting_.reserve(capacity_);
  factor_.resize(2 * capacity_ * (2 * capacity_ + 1) / 2);
}

bool MissingMarkers::update(std::span<const std::uint8_t> valid) {
  assert(valid.size() == listed_.size());
  if (static_cast<std::size_t>(std::count(valid.begin(), valid.end(), 0)) > capacity_) return false;

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
  double* const row = factor_.data() + size * (size + 1) / 2;
  for (std::size_t i = 0; i < size; ++i) row[i] = -inverse_.hatAt(coordinate, coordinates_[i]);
  solveLower(factor_, static_cast<int>(size), row);
  double pivot = 1.0 - inverse_.hatAt(coordinate, coordinate);
  for (std::size_t i = 0; i < size; ++i) pivot -= row[i] * row[i];
  if (!(pivot > 0.0)) return false;
  row[size] = 1.0 / std::sqrt(pivot);
  coordinates_.push_back(coordinate);
  return true;
}

void MissingMarkers::solve(double* rightHandSide) const {
  const auto size = static_cast<int>(coordinates_.size());
  solveLower(factor_, size, rightHandSide);
  solveLowerTransposed(factor_, size, rightHandSide);
}

}  // namespace tractiond::solve
