#include "daemon/solve/atom_products.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace tractiond::solve {
namespace {

constexpr int kLastOfBlock = 8;  // element

}  // namespace

AtomProducts::AtomProducts(const Factors& factors, int most)
    : factors_(factors)
    , stride_((kMotions + 3 * most + kColumns - 1) / kColumns * kColumns)
    , index_(factors.atomCount(), -1)
    , products_(stride_ * stride_, Pages::kSmall)
    , missing_(stride_ * factors.coordinateCount(), Pages::kSmall)
    , withPicture_(stride_) {
  atoms_.reserve(most);
}

void AtomProducts::begin(const Displacements& picture) {
  picture_ = &picture;
  forget();
}

/// Keeps nothing but the motion.
void AtomProducts::forget() {
  for (const int atom : atoms_) index_[atom] = -1;
  atoms_.clear();
  constexpr std::array<int, kMotions> kRows = {0, 1, 2, 3};
  multiplyRows(factors_.motion, kRows, picture_->displacement_px, withPicture_.data());
  for (int m = 0; m < kMotions; ++m) {
    for (int other = 0; other < kMotions; ++other)
      products_.data()[m * stride_ + other] = factors_.motionGram(m, other);
    for (std::size_t k = 0; k < picture_->missing.size(); ++k) {
      panel(0)[kColumns * static_cast<std::ptrdiff_t>(k) + m] = factors_.motion.row(m)[picture_->missing[k]];
    }
  }
  size_ = kMotions;
  takeOut(0);
}

void AtomProducts::add(std::span<const int> atoms) {
  const auto isNew = [this](int atom) { return indexOf(atom) < 0; };
  if (size_ + 3 * std::count_if(atoms.begin(), atoms.end(), isNew) > stride_) forget();
  const int first = size_;
  for (const int atom : atoms) {
    if (isNew(atom)) addAtom(atom);
  }
  takeOut(first);
}

/// Adds an atom's products over all coordinates.
void AtomProducts::addAtom(int atom) {
  const int first = size_;
  assert(first + 3 <= stride_);
  index_[atom] = first;
  atoms_.push_back(atom);
  size_ += 3;
  const std::array<int, 3> rows = {3 * atom, 3 * atom + 1, 3 * atom + 2};
  multiplyRows(factors_.influence, rows, picture_->displacement_px, withPicture_.data() + first);
  const auto store = [this](int i, int j, double product) {
    products_.data()[static_cast<std::ptrdiff_t>(i) * stride_ + j] = product;
    products_.data()[static_cast<std::ptrdiff_t>(j) * stride_ + i] = product;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (int m = 0; m < kMotions; ++m) store(first + axis, m, factors_.motionCoupling(m, 3 * atom + axis));
  }
  const auto blockOf = [&](int other) {
    return atom >= other ? factors_.gramOf(atom, other) : factors_.gramOf(other, atom);
  };
  for (const int other : atoms_) {  // they are all over the memory
    const double* const block = blockOf(other).data();
    __builtin_prefetch(block);
    __builtin_prefetch(block + kLastOfBlock);
  }
  for (std::size_t k = 0; k < atoms_.size(); ++k) {
    const int other = atoms_[k], at = kMotions + 3 * static_cast<int>(k);
    const bool isLater = atom >= other;
    const auto block = blockOf(other);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) store(first + i, at + j, isLater ? block(i, j) : block(j, i));
    }
  }
  const std::span<const int> missing = picture_->missing;
  for (int axis = 0; axis < 3; ++axis) {
    const int at = first + axis;
    const float* const from = factors_.influence.row(rows[axis]);
    double* const to = panel(at / kColumns) + at % kColumns;
    for (std::size_t k = 0; k < missing.size(); ++k) to[kColumns * static_cast<std::ptrdiff_t>(k)] = from[missing[k]];
  }
}

/// Takes what the missing coordinates have of them off the products of the components from `first` on.
void AtomProducts::takeOut(int first) {
  const auto count = static_cast<int>(picture_->missing.size());
  if (count == 0) return;
  std::array<double, kColumns * kColumns> products;
  for (int p = first / kColumns; kColumns * p < size_; ++p) {
    for (int q = 0; q <= p; ++q) {
      multiplyColumns(panel(p), panel(q), count, products.data());
      for (int i = std::max(kColumns * p, first); i < std::min(kColumns * (p + 1), size_); ++i) {
        for (int j = kColumns * q; j < std::min(kColumns * (q + 1), i + 1); ++j) {
          double& product = products_.data()[static_cast<std::ptrdiff_t>(i) * stride_ + j];
          product -= products[kColumns * (i % kColumns) + j % kColumns];
          products_.data()[static_cast<std::ptrdiff_t>(j) * stride_ + i] = product;
        }
      }
    }
  }
}

}  // namespace tractiond::solve
