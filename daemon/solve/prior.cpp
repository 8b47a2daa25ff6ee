#include "daemon/solve/prior.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Neighbours that count for less are left out: even beside the strongest contact they do not show.
constexpr double kNothing = 1e-12;

}  // namespace

Prior::Prior(const Atoms& atoms)
    : near_(atoms.count(), atoms.count())
    , alike_(atoms.count(), atoms.count())
    , wideColumn_(atoms.count(), -1)
    , evident_(atoms.count())
    , gathered_(evident_.size())
    , knownNear_(evident_.size())
    , gamma_(evident_.size()) {
  shown_.reserve(evident_.size());
  pulling_.reserve(evident_.size());
  for (int a = 0; a < atoms.count(); ++a) {
    const auto squares = (atoms.places.colwise() - atoms.places.col(a)).colwise().squaredNorm();
    alike_.col(a) = (-squares.transpose() / (2.0 * square(atoms.depth_m))).array().exp().cast<float>();
  }
  for (const Level& level : atoms.levels) {
    if (0.5 * level.spacing_m <= atoms.depth_m) continue;
    for (int a = level.first; a < level.end; ++a) {
      wideColumn_[a] = static_cast<int>(wide_.cols());
      const auto squares = (atoms.places.colwise() - atoms.places.col(a)).colwise().squaredNorm();
      wide_.conservativeResize(atoms.count(), wide_.cols() + 1);
      wide_.rightCols<1>() = (-squares.transpose() / (2.0 * square(0.5 * level.spacing_m))).array().exp().cast<float>();
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (const Level& level : atoms.levels) {
    for (int a = level.first; a < level.end; ++a) {
      for (int b = level.first; b < level.end; ++b) {
        const double r2 = (atoms.places.col(a) - atoms.places.col(b)).squaredNorm();
        const double k = std::exp(-r2 / (2.0 * square(ModelConstants::kCoupling * level.spacing_m)));
        if (k > kNothing) entries.emplace_back(a, b, k);
      }
    }
  }
  near_.setFromTriplets(entries.begin(), entries.end());
}

bool Prior::findEvident(const AtomMoments& moments) {
  shown_.clear();
  pulling_.clear();
  for (int a = 0; a < static_cast<int>(evident_.size()); ++a) {
    const auto mean = Eigen::Vector3d::Map(moments.mean_N.data() + 3 * static_cast<Index>(a));
    evident_[a] = std::max(0.0, mean.squaredNorm() - square(ModelConstants::kSignificance) * moments.noise_N2[a] / 3.0);
    if (evident_[a] == 0.0) continue;
    shown_.push_back(a);
    pulling_.emplace_back(evident_[a] / mean.squaredNorm() * mean * mean.transpose());
  }
  return !shown_.empty();
}

bool Prior::findGamma(const AtomMoments& moments) {
  if (!findEvident(moments)) return false;
  const auto count = static_cast<Index>(evident_.size());
  VectorXd::Map(gathered_.data(), count).noalias() = near_ * VectorXd::Map(evident_.data(), count);
  VectorXd::Map(knownNear_.data(), count).noalias() = near_ * VectorXd::Map(moments.known.data(), count);
  for (int a = 0; a < count; ++a) gamma_[a] = gathered_[a] > 0.0 ? gathered_[a] / knownNear_[a] : 0.0;
  return true;
}

void Prior::direct(Chosen& chosen, bool wide) const {
  chosen.covariance_N2.clear();
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) {
    const int atom = chosen.atoms[i];
    if (chosen.gamma_N2[i] == 0.0) {
      chosen.covariance_N2.emplace_back(Block::Zero());
      continue;
    }
    const bool isWide = wide && wideColumn_[atom] >= 0;
    const float* const alike = isWide ? wide_.col(wideColumn_[atom]).data() : alike_.col(atom).data();
    Block together = Block::Zero();
    for (std::size_t b = 0; b < shown_.size(); ++b) together += static_cast<double>(alike[shown_[b]]) * pulling_[b];
    const Block omega = together.trace() > 0.0 ? directions(together) : Block(Block::Identity());
    chosen.covariance_N2.emplace_back(chosen.gamma_N2[i] * omega);
  }
}

}  // namespace tractiond::solve
