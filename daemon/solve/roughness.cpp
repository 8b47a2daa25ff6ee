#include "daemon/solve/roughness.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Neighbours whose weight is less are left out.
constexpr double kNothing = 1e-12;
/// Pressure of a point beneath which nothing is, as a share of the largest.
constexpr double kFaintest = 1e-6;

}  // namespace

Roughness::Roughness(const Atoms& atoms, const ModelOptions& options)
    : share_(options.roughness)
    , atoms_(atoms)
    , spread_(atoms.pointCount(), atoms.pointCount())
    , pointForce_(3 * static_cast<std::size_t>(atoms.pointCount()))
    , force_(static_cast<std::size_t>(atoms.pointCount()))
    , pressure_(force_.size())
    , gamma_(static_cast<std::size_t>(atoms.count())) {
  for (int a = 0; a < atoms.count(); ++a) {
    peak_.push_back(Eigen::VectorXd(atoms.shape.col(a)).maxCoeff());
  }
  std::vector<Eigen::Triplet<double>> entries;
  const double pitch_m = atoms.levels.front().spacing_m;
  for (Index p = 0; p < atoms.points.cols(); ++p) {
    const Eigen::RowVectorXd weights =
        (-(atoms.points.colwise() - atoms.points.col(p)).colwise().squaredNorm() / (2.0 * square(pitch_m)))
            .array()
            .exp();
    for (Index q = 0; q < weights.size(); ++q) {
      if (weights[q] > kNothing) entries.emplace_back(p, q, weights[q] / weights.sum());
    }
  }
  spread_.setFromTriplets(entries.begin(), entries.end());
}

std::span<const double> Roughness::add(std::span<const double> mean_N, const Chosen& chosen) {
  const Index points = atoms_.pointCount();
  addUp(atoms_, mean_N, pointForce_);
  for (Index p = 0; p < points; ++p) force_[p] = Eigen::Vector3d::Map(pointForce_.data() + 3 * p).norm();
  VectorXd::Map(pressure_.data(), points).noalias() = spread_ * VectorXd::Map(force_.data(), points);
  const double largest = *std::max_element(pressure_.begin(), pressure_.end());
  assert(largest > 0.0);
  for (int a = 0; a < atoms_.count(); ++a) {
    double reciprocal = 0.0;
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms_.shape, a); it; ++it) {
      reciprocal += it.value() / (pressure_[it.row()] + kFaintest * largest);
    }
    gamma_[a] = square(share_ / (reciprocal * peak_[a])) / 3.0;
  }
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) gamma_[chosen.atoms[i]] += chosen.gamma_N2[i];
  return gamma_;
}

}  // namespace tractiond::solve
