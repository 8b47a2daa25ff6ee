#include "daemon/solve/roughness.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Neighbours whose weight is less are left out.
constexpr double kNothing = 1e-12;
/// Pressure of a point beneath which nothing is, as a share of the largest.
constexpr double kFaintest = 1e-6;

/// Weights of points side by side, each row with the sum 1.
MatrixXd weightsAlong(int count, double reach) {
  MatrixXd weights(count, count);
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) weights(i, j) = std::exp(-square(i - j) / (2.0 * square(reach)));
    weights.row(i) /= weights.row(i).sum();
  }
  return weights;
}

}  // namespace

Spread::Spread(const Atoms& atoms, double reach_m)
    : across_(weightsAlong(atoms.columns, reach_m / atoms.pitch_m))
    , along_(weightsAlong(atoms.rows, reach_m / atoms.pitch_m))
    , product_(atoms.columns, atoms.rows) {
  if (across_.size() > 0) return;
  std::vector<Eigen::Triplet<double>> entries;
  for (Index p = 0; p < atoms.points.cols(); ++p) {
    const auto squares = (atoms.points.colwise() - atoms.points.col(p)).colwise().squaredNorm();
    const Eigen::RowVectorXd weights = (-squares / (2.0 * square(reach_m))).array().exp();
    for (Index q = 0; q < weights.size(); ++q) {
      if (weights[q] > kNothing) entries.emplace_back(p, q, weights[q] / weights.sum());
    }
  }
  any_.resize(atoms.pointCount(), atoms.pointCount());
  any_.setFromTriplets(entries.begin(), entries.end());
}

void Spread::average(const VectorXd& from, VectorXd& to) {
  if (across_.size() == 0) {
    to.noalias() = any_ * from;
    return;
  }
  // The weights of a grid are products of those along its axes. Row after row, as the points are.
  product_.noalias() = across_.lazyProduct(MatrixXd::Map(from.data(), across_.rows(), along_.rows()));
  MatrixXd::Map(to.data(), across_.rows(), along_.rows()).noalias() = product_.lazyProduct(along_.transpose());
}

Roughness::Roughness(const Factors& factors, const Atoms& atoms)
    : atoms_(atoms)
    , pointForce_(3 * atoms.pointCount())
    , force_(atoms.pointCount())
    , pressure_(atoms.pointCount())
    , gamma_(atoms.count())
    , unseen_(gamma_.size()) {
  for (const Level& level : atoms.levels) {
    addTo(groups_, level, level.reach_m);
    const bool isOfPoints = level.first == 0 && atoms.levels.size() > 1;  // a body has no others
    if (!isOfPoints) addTo(around_, level, std::hypot(level.reach_m, ModelConstants::kAround * atoms.pitch_m));
    for (int a = level.first; a < level.end; ++a) {
      const bool isBeyond = a < atoms.pointCount() && atoms.nodes[a] < 0;
      isTold_.push_back(level.ambiguous || isBeyond ? 0 : 1);
      largest_.push_back(VectorXd(atoms.shape.col(a)).maxCoeff());
      mostUnseen_.push_back(1.0 / factors.gramOf(a, a).trace());
    }
  }
}

/// Adds a level to the group with this reach.
void Roughness::addTo(std::vector<Group>& groups, const Level& level, double reach_m) {
  auto group = std::find_if(groups.begin(), groups.end(), [&](const Group& each) { return each.reach_m == reach_m; });
  if (group == groups.end()) group = groups.insert(group, {reach_m, Spread(atoms_, reach_m), {}});
  for (int a = level.first; a < level.end; ++a) group->atoms.push_back(a);
}

std::span<const double> Roughness::add(std::span<const double> mean_N, const Chosen& chosen, double unseen_px) {
  addUp(atoms_, mean_N, pointForce_);
  of(pointForce_, ModelConstants::kRoughness);
  if (unseen_px > 0.0) {
    beneath(pointForce_, true, around_, unseen_);
    const double square_px2 = square(unseen_px);
    for (std::size_t a = 0; a < gamma_.size(); ++a) gamma_[a] += std::min(unseen_[a], square_px2 * mostUnseen_[a]);
  }
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) gamma_[chosen.atoms[i]] += chosen.gamma_N2[i];
  return gamma_;
}

std::span<const double> Roughness::of(std::span<const double> pointForces_N, double rho) {
  beneath(pointForces_N, true, groups_, gamma_);
  for (std::size_t a = 0; a < gamma_.size(); ++a) gamma_[a] *= isTold_[a] != 0 ? square(rho) : 1.0;
  return gamma_;
}

std::span<const double> Roughness::ofPatches(std::span<const double> pointForces_N) {
  beneath(pointForces_N, false, groups_, gamma_);
  return gamma_;
}

/// Computes gamma of the groups' atoms for rho = 1.
/// \param continues whether points beyond the nodes have at least the pressure of the nearest node
void Roughness::beneath(std::span<const double> pointForces_N, bool continues, std::vector<Group>& groups,
                        std::span<double> gamma) {
  for (Index p = 0; p < force_.size(); ++p) force_[p] = Eigen::Vector3d::Map(pointForces_N.data() + 3 * p).norm();
  for (Group& group : groups) {
    group.spread.average(force_, pressure_);
    const double largest = pressure_.maxCoeff();
    assert(largest > 0.0);
    for (Index p = 0; continues && p < pressure_.size(); ++p) {  // nodes are their own nearest: they stay what they are
      if (atoms_.nodes[p] < 0) pressure_[p] = std::max(pressure_[p], pressure_[atoms_.nearest[p]]);
    }
    pressure_ = (pressure_.array() + kFaintest * largest).inverse();
    for (const int a : group.atoms) {
      double reciprocal = 0.0;
      for (Eigen::SparseMatrix<double>::InnerIterator it(atoms_.shape, a); it; ++it) {
        reciprocal += it.value() * pressure_[it.row()];
      }
      gamma[a] = square(1.0 / (reciprocal * largest_[a])) / 3.0;
    }
  }
}

}  // namespace tractiond::solve
