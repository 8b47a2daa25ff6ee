#include "daemon/solve/evidence.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace tractiond::solve {
namespace {

using Eigen::Index;

/// tau is one of exp(kFirst), exp(kFirst + kStep) .. times Factors::force_N, from far below the detection limit to far
/// above what a gel bears.
constexpr double kFirst = -12.0, kStep = 0.25;
constexpr int kRatios = 51;

}  // namespace

void resize(AtomMoments& moments, int atoms) {
  const auto count = static_cast<std::size_t>(atoms);
  moments.mean_N.assign(3 * count, 0.0);
  moments.known.assign(count, 0.0);
  moments.noise_N2.assign(count, 0.0);
}

Evidence::Evidence(const Factors& factors, const Atoms& atoms, const ModelOptions& options)
    : factors_(factors)
    , atoms_(atoms)
    , visible_(options.visible)
    , unexplained_(factors.rank(), kRatios)
    , logarithms_(factors.rank(), kRatios)
    , known_(atoms.count(), kRatios)
    , noise_(atoms.count(), kRatios)
    , everyPoint_(static_cast<std::size_t>(factors.right.rows()))
    , power_(static_cast<std::size_t>(factors.rank()))
    , filtered_(static_cast<std::size_t>(factors.right.stride()))
    , pointMean_(everyPoint_.size())
    , coefficients_(everyPoint_.size()) {
  std::iota(everyPoint_.begin(), everyPoint_.end(), 0);
  const int rank = factors.rank();
  Eigen::MatrixXd power = Eigen::MatrixXd::Zero(atoms.count(), rank);  // |v|^2 of each atom and mode
  Eigen::MatrixXd row(3, rank);
  for (int a = 0; a < atoms.count(); ++a) {
    row.setZero();
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
      for (int axis = 0; axis < 3; ++axis) {
        const float* const v = factors.right.row(3 * static_cast<int>(it.row()) + axis);
        row.row(axis) += it.value() * Eigen::RowVectorXf::Map(v, rank).cast<double>();
      }
    }
    power.row(a) = row.colwise().squaredNorm();
  }
  for (const double least : options.groups) {
    const auto isStrong = [&](double s) { return s > least * options.noise_px / factors.force_N; };
    const auto end = std::partition_point(factors.singularValues.begin(), factors.singularValues.end(), isStrong);
    const auto count = static_cast<int>(end - factors.singularValues.begin());
    if (count > (ends_.empty() ? 0 : ends_.back()) && count < rank) ends_.push_back(count);
  }
  ends_.push_back(rank);
  const Eigen::ArrayXd s2 = Eigen::ArrayXd::Map(factors.singularValues.data(), rank).square();
  for (int i = 0; i < kRatios; ++i) {
    const double ratio = factors.force_N * std::exp(kFirst + kStep * i) / options.noise_px;
    const Eigen::ArrayXd total = s2 * ratio * ratio + 1.0;
    ratios_.push_back(ratio);
    const Eigen::ArrayXd logarithms = total.log();
    std::partial_sum(logarithms.begin(), logarithms.end(), logarithms_.col(i).data());
    unexplained_.col(i) = total.inverse();
    used_.push_back(ends_[static_cast<std::size_t>(lastVisible(i))]);
    const Eigen::VectorXd gain = (1.0 - total.inverse()).head(used_.back());
    known_.col(i) = power.leftCols(used_.back()) * gain;
    noise_.col(i) = power.leftCols(used_.back()) * (gain.array().square() / s2.head(used_.back())).matrix();
  }
}

/// Returns the last group of modes in which forces of that size are visible.
int Evidence::lastVisible(int ratio) const {
  std::size_t group = 0;
  while (group + 1 < ends_.size() && factors_.singularValues[ends_[group]] * ratios_[ratio] >= visible_) ++group;
  return static_cast<int>(group);
}

int Evidence::modesToRead(std::span<const double> amplitudes, double noise_px) {
  const auto count = static_cast<int>(amplitudes.size());
  if (count == 0) return ends_.front();
  if (used_[likeliest(amplitudes, noise_px)] <= count) return count;
  return *std::upper_bound(ends_.begin(), ends_.end(), count);
}

int Evidence::likeliest(std::span<const double> amplitudes, double noise_px) {
  const auto count = static_cast<int>(amplitudes.size()), rank = factors_.rank();
  assert(count > 0 && count <= rank);
  for (int k = 0; k < count; ++k) power_[k] = square(amplitudes[k]);
  int best = 0;
  double least = 0.0;  // -2 times the evidence, but for the modes' ln n^2
  for (int i = 0; i < kRatios; ++i) {
    const double* const share = unexplained_.data() + static_cast<std::ptrdiff_t>(i) * rank;
    const double unlikely = logarithms_(count - 1, i) + dotProduct(power_.data(), share, count) / square(noise_px);
    if (i == 0 || unlikely < least) {
      best = i;
      least = unlikely;
    }
  }
  return best;
}

double Evidence::typicalForce_N(std::span<const double> amplitudes, double noise_px) {
  return ratios_[likeliest(amplitudes, noise_px)] * noise_px;
}

void Evidence::start(std::span<const double> amplitudes, double noise_px, AtomMoments& moments) {
  const int best = likeliest(amplitudes, noise_px), used = std::min(used_[best], static_cast<int>(amplitudes.size()));
  for (int k = 0; k < used; ++k) {
    filtered_.data()[k] = (1.0 - unexplained_(k, best)) / factors_.singularValues[k] * amplitudes[k];
  }
  std::fill_n(filtered_.data() + used, padded(used) - used, 0.0);
  multiplyFirst(factors_.right, everyPoint_, used, filtered_.data(), pointMean_.data());
  for (int a = 0; a < atoms_.count(); ++a) {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms_.shape, a); it; ++it) {
      mean += it.value() * Eigen::Vector3d::Map(pointMean_.data() + 3 * it.row());
    }
    Eigen::Vector3d::Map(moments.mean_N.data() + 3 * static_cast<Index>(a)) = mean;
    moments.known[a] = known_(a, best);
    moments.noise_N2[a] = square(noise_px) * noise_(a, best);
  }
}

void Evidence::subtract(std::span<const double> forces_N, std::span<double> amplitudes) {
  for (std::size_t i = 0; i < coefficients_.size(); ++i) coefficients_[i] = static_cast<float>(forces_N[i]);
  std::fill_n(filtered_.data(), filtered_.size(), 0.0);
  addColumns(factors_.right, everyPoint_, coefficients_, 0, static_cast<int>(amplitudes.size()), filtered_.data());
  for (std::size_t k = 0; k < amplitudes.size(); ++k) amplitudes[k] -= factors_.singularValues[k] * filtered_.data()[k];
}

}  // namespace tractiond::solve
