#include "daemon/solve/posterior.h"

#include <Eigen/Cholesky>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr std::array<int, kMotions> kEveryMotion = {0, 1, 2, 3};

/// In place of a call of memmove.
void copyThree(const double* from, double* to) {
  for (int i = 0; i < 3; ++i) to[i] = from[i];
}

}  // namespace

Posterior::Posterior(const Factors& factors, const Atoms& atoms, int most, int mostExtra)
    : factors_(factors)
    , atoms_(atoms)
    , stride_((3 * most + mostExtra + kMotions + kColumns - 1) / kColumns * kColumns)
    , tightness_(most)
    , index_(tightness_.size())
    , right_(stride_)
    , x_(right_.size())
    , matrix_(packed(stride_), Pages::kSmall)
    , scratch_(kColumns * right_.size())
    , panels_(right_.size() * right_.size(), Pages::kSmall)
    , inverse_(right_.size() * right_.size(), Pages::kSmall)
    , known_(most)
    , indexOf_(atoms.count(), -1)
    , covering_(most + mostExtra)
    , share_(covering_.size())
    , together_(right_.size() / kColumns * (right_.size() / kColumns)) {}

bool Posterior::fit(const Displacements& picture, AtomProducts& products, const Chosen& chosen, ExtraUnknowns* extra) {
  chosen_ = &chosen;
  extra_ = extra;
  diagonalInverted_ = false;
  assert(unknowns() <= stride_ && picture.noise_px > 0.0);
  noise_px_ = picture.noise_px;
  std::fill(indexOf_.begin(), indexOf_.end(), -1);
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) indexOf_[chosen.atoms[i]] = static_cast<int>(i);
  const int size = unknowns();
  if (!invertPriors()) return false;
  products.add(chosen.atoms);
  multiplyDisplacement(picture, products);
  assemble(products);
  assembleExtra();
  if (!factoriseLower({matrix_.data(), packed(size)}, size, scratch_.data())) return false;
  std::copy_n(right_.begin(), size, x_.begin());
  solveLower({matrix_.data(), packed(size)}, size, x_.data());
  solveLowerTransposed({matrix_.data(), packed(size)}, size, x_.data());
  double strain = dotProduct(x_.data() + firstExtra(), x_.data() + firstExtra(), size - firstExtra());  // x' C^-1 x
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) {
    const auto force = Vector3d::Map(x_.data() + 3 * i);
    strain += force.dot(tightness_[i] * force);
  }
  // |d - B x|^2, B'B x being B'd - n^2 C^-1 x.
  squaredResidual_ = picture.squares_px2 - dotProduct(x_.data(), right_.data(), size) - square(noise_px_) * strain;
  double logDeterminant = logPrior_;  // of C A, the factor's diagonal being stored as the reciprocal
  for (int i = 0; i < size; ++i) logDeterminant -= 2.0 * std::log(row(i)[i]);
  logEvidence_ =
      -0.5 * (logDeterminant - size * std::log(square(noise_px_)) + squaredResidual_ / square(noise_px_) + strain);
  std::copy_n(x_.begin() + firstMotion(), kMotions, motion_.begin());
  return true;
}

/// Computes C^-1 and log det C. False: a covariance is not positive.
bool Posterior::invertPriors() {
  logPrior_ = 0.0;
  for (std::size_t i = 0; i < chosen_->atoms.size(); ++i) {
    const Eigen::LLT<Block> root(chosen_->covariance_N2[i]);
    if (root.info() != Eigen::Success) return false;
    tightness_[i] = root.solve(Block::Identity());
    logPrior_ += 2.0 * std::log(root.matrixLLT().diagonal().prod());
  }
  return true;
}

/// Computes the blocks of A^-1 along the diagonal, unless that was done.
void Posterior::invertDiagonal() {
  if (diagonalInverted_) return;
  diagonalInverted_ = true;
  for (int panel = 0; kColumns * panel < unknowns(); ++panel) {
    invertColumns(panel);
    invert(panel, panel);
    if (panel > 0) invert(panel, panel - 1);  // an atom may lie across two
  }
}

/// Computes a panel of the factor's inverse.
void Posterior::invertColumns(int panel) {
  inverseColumns({matrix_.data(), packed(unknowns())}, kColumns * panel, unknowns(),
                 panels_.data() + static_cast<std::ptrdiff_t>(panel) * kColumns * stride_);
}

std::span<const double> Posterior::known() {
  invertDiagonal();
  for (std::size_t i = 0; i < chosen_->atoms.size(); ++i) {
    known_[i] = 3.0 - square(noise_px_) * traceOf(static_cast<int>(i)) / chosen_->gamma_N2[i];
  }
  return {known_.data(), chosen_->atoms.size()};
}

/// Fills B'd.
void Posterior::multiplyDisplacement(const Displacements& picture, const AtomProducts& products) {
  double* to = right_.data();
  for (const int atom : chosen_->atoms) {
    const double* const withExtra = extra_ == nullptr ? nullptr : extra_->productsWith(atom) + extra_->count();
    for (int axis = 0; axis < 3; ++axis) {
      *to++ =
          extra_ == nullptr ? products.withPicture(products.indexOf(atom) + axis) : withExtra[axis * extra_->stride()];
    }
  }
  for (int i = 0; i < static_cast<int>(extraCount()); ++i) *to++ = extra_->withDisplacement(i);
  multiplyRows(factors_.motion, kEveryMotion, picture.displacement_px, to);
}

void Posterior::assemble(const AtomProducts& products) {
  const double n2 = square(noise_px_);
  const int count = static_cast<int>(chosen_->atoms.size());
  for (int i = 0; i < count; ++i) index_[i] = products.indexOf(chosen_->atoms[i]);
  for (int i = 0; i < count; ++i) {
    for (int r = 0; r < 3; ++r) {
      const double* const from = products.row(index_[i] + r);
      double* const to = row(3 * i + r);
      for (int j = 0; j < i; ++j) copyThree(from + index_[j], to + 3 * j);
      for (int c = 0; c <= r; ++c) to[3 * i + c] = from[index_[i] + c] + n2 * tightness_[i](r, c);
    }
  }
  for (int m = 0; m < kMotions; ++m) {
    const double* const from = products.row(m);
    double* const to = row(firstMotion() + m);
    for (int j = 0; j < count; ++j) copyThree(from + index_[j], to + 3 * j);
    std::copy_n(from, m + 1, to + firstMotion());
    to[firstMotion() + m] += n2;
  }
}

/// Fills the rows and columns of the extra unknowns.
void Posterior::assembleExtra() {
  const int first = firstExtra(), count = static_cast<int>(extraCount());
  for (std::size_t j = 0; j < chosen_->atoms.size() && count > 0; ++j) {
    const double* const products = extra_->productsWith(chosen_->atoms[j]);
    for (int i = 0; i < count; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) row(first + i)[3 * j + axis] = products[axis * extra_->stride() + i];
    }
  }
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j <= i; ++j) row(first + i)[first + j] = extra_->product(i, j);
    row(first + i)[first + i] += square(noise_px_);
    for (int m = 0; m < kMotions; ++m) row(firstMotion() + m)[first + i] = extra_->withMotion(i, m);
  }
}

/// Computes the block of A^-1 of two panels, panel >= other, and its mirror image.
void Posterior::invert(int panel, int other) {
  const int first = kColumns * panel, size = unknowns();
  const auto of = [&](int p) { return panels_.data() + static_cast<std::ptrdiff_t>(p) * kColumns * stride_; };
  double products[kColumns * kColumns];
  multiplyColumns(of(panel) + kColumns * first, of(other) + kColumns * first, size - first, products);
  const std::ptrdiff_t at = first, beside = kColumns * std::ptrdiff_t{other};
  for (int i = 0; i < kColumns; ++i) {
    double *const to = inverse_.data() + (at + i) * stride_ + beside, *const mirrored =
                                                                          inverse_.data() + (beside + i) * stride_ + at;
    for (int j = 0; j < kColumns; ++j) {
      to[j] = products[kColumns * i + j];
      mirrored[j] = products[kColumns * j + i];
    }
  }
}

/// Trace of an atom's block of A^-1.
double Posterior::traceOf(int atom) const {
  double sum = 0.0;
  for (int i = 3 * atom; i < 3 * atom + 3; ++i) sum += inverse_.data()[i * std::ptrdiff_t{stride_} + i];
  return sum;
}

/// Computes all blocks of A^-1.
void Posterior::invertAll() {
  invertDiagonal();
  for (int panel = 2; kColumns * panel < unknowns(); ++panel) {
    for (int other = 0; other < panel - 1; ++other) invert(panel, other);
  }
}

void Posterior::noise_N2(std::span<double> noise) {
  const int size = unknowns();
  invertAll();
  for (int i = 0; i < static_cast<int>(chosen_->atoms.size()); ++i) {
    double sum = 0.0;  // trace of A^-1 C^-1 A^-1
    for (int r = 3 * i; r < 3 * i + 3; ++r) {
      const double* const of = inverse_.data() + r * std::ptrdiff_t{stride_};
      for (std::size_t j = 0; j < chosen_->atoms.size(); ++j) {
        const auto block = Vector3d::Map(of + 3 * j);
        sum += block.dot(tightness_[j] * block);
      }
      sum += dotProduct(of + firstExtra(), of + firstExtra(), size - firstExtra());
    }
    noise[i] = square(noise_px_) * (traceOf(i) - square(noise_px_) * sum);
  }
}

void Posterior::allForces_N(std::span<double> forces) const {
  std::fill(forces.begin(), forces.end(), 0.0);
  for (std::size_t i = 0; i < chosen_->atoms.size(); ++i) {
    std::copy_n(x_.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                forces.begin() + 3 * static_cast<std::ptrdiff_t>(chosen_->atoms[i]));
  }
}

double Posterior::keep(std::span<const double> noise, AtomMoments& moments) {
  double degrees = 0.0;
  const auto known = this->known();
  for (std::size_t i = 0; i < chosen_->atoms.size(); ++i) {
    const auto atom = static_cast<std::size_t>(chosen_->atoms[i]);
    std::copy_n(x_.begin() + static_cast<std::ptrdiff_t>(3 * i), 3,
                moments.mean_N.begin() + static_cast<std::ptrdiff_t>(3 * atom));
    moments.known[atom] = known[i];
    moments.noise_N2[atom] = noise[i];
    degrees += known[i];
  }
  return degrees;
}

Wrench Posterior::wrench() const {
  Wrench sum = Wrench::Zero();
  for (std::size_t i = 0; i < chosen_->atoms.size(); ++i) {
    sum += atoms_.wrench.middleCols<3>(3 * static_cast<Index>(chosen_->atoms[i])) * Vector3d::Map(x_.data() + 3 * i);
  }
  for (std::size_t i = 0; i < extraCount(); ++i) {
    sum += extra()[i] * std::as_const(*extra_).wrench(static_cast<int>(i));
  }
  return sum;
}

}  // namespace tractiond::solve
