#include "daemon/solve/extra_unknowns.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace tractiond::solve {

ExtraUnknowns::ExtraUnknowns(const Factors& factors, const Atoms& atoms, int most)
    : factors_(factors)
    , atoms_(atoms)
    , ofPoints_(3 * (factors.pointCount() + kCouples))
    , ofNodes_(3 * atoms.nodeCount())
    , stride_((most + kColumns) / kColumns * kColumns)
    , columns_(stride_ * factors.influence.stride())
    , motion_(kColumns * factors.influence.stride())
    , wrench_(most)
    , pointForces_(most * ofPoints_)
    , nodeForces_(most * ofNodes_)
    , gram_(stride_ * stride_)
    , withMotion_(stride_ * kColumns)
    , withAtoms_(factors.influence.rows() * stride_)
    , asked_(factors.atomCount()) {}

void ExtraUnknowns::begin(int count) {
  assert(count <= static_cast<int>(wrench_.size()));
  count_ = count;
  std::fill_n(columns_.data(), static_cast<std::ptrdiff_t>(panels()) * kColumns * factors_.influence.stride(), 0.0);
  std::fill_n(wrench_.begin(), count, Wrench::Zero());
  std::fill_n(pointForces_.begin(), count * ofPoints_, 0.0);
  std::fill(asked_.begin(), asked_.end(), static_cast<unsigned char>(0));
}

void ExtraUnknowns::setDisplacement(int unknown, const double* displacement_px, double factor) {
  double* const to = panel(unknown / kColumns) + unknown % kColumns;
  for (int j = 0; j < factors_.coordinateCount(); ++j) to[kColumns * j] = factor * displacement_px[j];
}

void ExtraUnknowns::multiply(const Displacements& picture) {
  const int coordinates = factors_.coordinateCount();
  setDisplacement(count_, picture.displacement_px, 1.0);
  for (int j = 0; j < coordinates; ++j) {
    for (int m = 0; m < kMotions; ++m) motion_.data()[kColumns * j + m] = factors_.motion.row(m)[j];
  }
  for (int i = 0; i < count_; ++i) {
    addAtNodes(atoms_, pointForces_N(i), std::span(nodeForces_).subspan(ofNodes_ * i, ofNodes_));
  }
  std::array<double, kColumns * kColumns> products;
  for (int p = 0; p < panels(); ++p) {
    multiplyColumns(panel(p), motion_.data(), coordinates, withMotion_.data() + kColumns * kColumns * p);
    for (int q = 0; q <= p; ++q) {
      multiplyColumns(panel(p), panel(q), coordinates, products.data());
      for (int i = 0; i < kColumns; ++i) {
        for (int j = 0; j < kColumns; ++j) {
          const int a = kColumns * p + i, b = kColumns * q + j;
          gram_[index(a, b)] = gram_[index(b, a)] = products[kColumns * i + j];
        }
      }
    }
  }
}

void ExtraUnknowns::displacement(int unknown, float* to) const {
  const double* const from = columns_.data() + panelAt(unknown / kColumns) + unknown % kColumns;
  for (std::ptrdiff_t j = 0; j < factors_.coordinateCount(); ++j) to[j] = static_cast<float>(from[kColumns * j]);
}

const double* ExtraUnknowns::productsWith(int atom) {
  double* const products = withAtoms_.data() + index(3 * atom, 0);
  if (asked_[atom] == 0) {
    asked_[atom] = 1;
    const std::array<int, 3> rows = {3 * atom, 3 * atom + 1, 3 * atom + 2};
    for (int p = 0; p < panels(); ++p) {
      multiplyRowsByColumns(factors_.influence, rows, panel(p), products + kColumns * p, stride_);
    }
  }
  return products;
}

}  // namespace tractiond::solve
