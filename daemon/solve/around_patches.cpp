#include "daemon/solve/around_patches.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace tractiond::solve {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// Change of a place, in its prior deviation, that derivatives of the shares are computed from.
constexpr double kSmall = 0.01;

}  // namespace

AroundPatches::AroundPatches(const Factors& factors, const Atoms& atoms, Prior& prior, Selection& selection,
                             Roughness& roughness)
    : atoms_(atoms)
    , prior_(prior)
    , selection_(selection)
    , roughness_(roughness)
    , spread_(atoms)
    , extra_(factors, atoms, kMostFreed)
    , smooth_(atoms.count())
    , rough_(smooth_.size())
    , whole_(smooth_.size())
    , noise_(kMostAtoms)
    , here_(3 * (atoms.pointCount() + kCouples)) {
  resize(moments_, atoms.count());
  for (std::size_t i = 0; i < kRoughness.size(); ++i) solutions_.emplace_back(factors, atoms, kMostAtoms, kMostFreed);
}

bool AroundPatches::solve(const Displacements& left, AtomProducts& products, const AtomMoments& start,
                          const RoundPatches& patches) {
  freed_ = FreedPatches(patches.patches(), atoms_.pitch_m);
  occam_ = std::log(static_cast<double>(kRoughness.size())) +
           freed_.count() * (std::log(atoms_.nodeCount()) + RoundPatches::kLeastGain);
  setExtra(left, patches);
  return findEvident(left, products, start) && roughen(left, products);
}

/// Frees loads and places of the patches, linearly about the fit.
void AroundPatches::setExtra(const Displacements& left, const RoundPatches& patches) {
  const int count = freed_.count();
  extra_.begin(kPerPatch * count);
  for (int k = 0; k < count; ++k) {
    const RoundPatch& patch = freed_.patch(k);
    const Vector3d at(patch.place.x_m, patch.place.y_m, 0.0), force = patch.load.head<3>();
    for (int i = 0; i < kPerPatch; ++i) {
      const bool isLoad = i < kPatchLoads;
      const int unknown = freed_.index(k, i);
      extra_.setDisplacement(unknown, isLoad ? patches.column(k, i) : patches.slope(k, i - kPatchLoads),
                             freed_.unit(k, i));
      auto& wrench = extra_.wrench(unknown);
      if (i < 3) {
        wrench << Vector3d::Unit(i), at.cross(Vector3d::Unit(i));
      } else if (isLoad) {
        wrench[5] = 1.0;
      } else if (i < kPatchLoads + 2) {
        wrench << Vector3d::Zero(), Vector3d::Unit(i - kPatchLoads).cross(force);
      }
      wrench *= freed_.unit(k, i);
    }
    spread_.divide(patch.place, true);
    for (int i = 0; i < kPatchLoads; ++i) {
      spread_.add(freed_.unit(k, i) * PatchLoad::Unit(i), k, extra_.pointForces_N(freed_.index(k, i)));
    }
    here_.setZero();
    spread_.add(patch.load, k, {here_.data(), static_cast<std::size_t>(here_.size())});
    for (int i = 0; i < kPatchPlaces; ++i) {  // by differences
      PatchPlace moved = patch.place;
      element(moved, i) += kSmall * freed_.unit(k, kPatchLoads + i);
      spread_.divide(moved, true);
      const auto forces = extra_.pointForces_N(freed_.index(k, kPatchLoads + i));
      spread_.add(patch.load, k, forces);
      auto change = Eigen::VectorXd::Map(forces.data(), here_.size());
      change = (change - here_) / kSmall;
    }
  }
  extra_.multiply(left);
}

/// Does the rounds; smooth_ becomes the gamma of what they find. False: the equations could not be solved.
bool AroundPatches::findEvident(const Displacements& left, AtomProducts& products, const AtomMoments& start) {
  std::fill(smooth_.begin(), smooth_.end(), 0.0);
  const AtomMoments* seen = &start;
  Chosen& chosen = solutions_[0].chosen;
  const auto& rounds = ModelConstants::kMost[0];
  for (std::size_t i = 0; i < rounds.size(); ++i) {
    if (!prior_.findGamma(*seen)) return true;
    selection_.choose(prior_.gamma_N2(), rounds[i], true, left.noise_px, chosen);
    if (chosen.atoms.empty() || i + 1 == rounds.size()) break;
    prior_.direct(chosen, false);
    if (!solutions_[0].posterior.fit(left, products, chosen, &extra_)) return false;
    keep(start);
    seen = &moments_;
  }
  for (std::size_t i = 0; i < chosen.atoms.size(); ++i) {
    smooth_[chosen.atoms[i]] = chosen.gamma_N2[i];
  }
  return true;
}

/// Takes the moments of what a round found; atoms without a force stay what `start` says.
void AroundPatches::keep(const AtomMoments& start) {
  auto& [chosen, posterior] = solutions_[0];
  std::fill(moments_.mean_N.begin(), moments_.mean_N.end(), 0.0);
  std::fill(moments_.noise_N2.begin(), moments_.noise_N2.end(), 0.0);
  moments_.known = start.known;
  posterior.noise_N2(noise_);
  posterior.keep(noise_, moments_);
}

/// Adds the roughness of the patches, in each of its sizes, and solves.
bool AroundPatches::roughen(const Displacements& left, AtomProducts& products) {
  std::vector<double>& forces = moments_.mean_N;  // of the points, as the patches have them
  std::fill(forces.begin(), forces.end(), 0.0);
  Block along = Block::Zero();
  for (const RoundPatch& patch : freed_.patches()) {
    const Vector3d force = patch.load.head<3>();
    along += force * force.transpose();
    const auto share = spread_.divide(patch.place, false);
    for (std::size_t p = 0; p < share.size(); ++p) Vector3d::Map(forces.data() + 3 * p) += share[p] * force;
  }
  const Block omega = directions(along);
  const bool isAlone = std::all_of(smooth_.begin(), smooth_.end(), [](double gamma) { return gamma == 0.0; });
  const int most = isAlone ? std::min(kMostAtoms, ModelConstants::kMostAlone * freed_.count()) : kMostAtoms;
  const auto rough = roughness_.ofPatches(std::span(forces).first(3 * atoms_.pointCount()));
  std::copy(rough.begin(), rough.end(), rough_.begin());
  for (std::size_t i = 0; i < kRoughness.size(); ++i) {
    auto& [chosen, posterior] = solutions_[i];
    for (std::size_t a = 0; a < whole_.size(); ++a) whole_[a] = smooth_[a] + square(kRoughness[i]) * rough_[a];
    selection_.choose(whole_, most, false, left.noise_px, chosen);
    // Of two variances each has its own directions.
    for (std::size_t c = 0; c < chosen.atoms.size(); ++c) {
      chosen.gamma_N2[c] = smooth_[chosen.atoms[c]];
    }
    prior_.direct(chosen, true);
    for (std::size_t c = 0; c < chosen.atoms.size(); ++c) {
      const double own = square(kRoughness[i]) * rough_[chosen.atoms[c]];
      chosen.covariance_N2[c] += own * omega;
      chosen.gamma_N2[c] += own;
    }
    if (!posterior.fit(left, products, chosen, &extra_)) return false;
  }
  return true;
}

FoundPatch AroundPatches::found(int patch) {
  constexpr int kCount = static_cast<int>(kRoughness.size());
  double most = logEvidence(0), sum = 0.0;
  for (int i = 1; i < kCount; ++i) most = std::max(most, logEvidence(i));
  std::array<double, kRoughness.size()> share{};
  for (int i = 0; i < kCount; ++i) sum += share[i] = std::exp(logEvidence(i) - most);
  PatchChange mean = PatchChange::Zero();
  for (int i = 0; i < kCount; ++i) mean += share[i] / sum * change(i, patch);

  FoundPatch found;
  found.patch = freed_.changed(patch, mean);
  const int count = extra_.count();
  for (int i = 0; i < kCount; ++i) {
    const PatchChange away = change(i, patch) - mean;
    posterior(i).extraCovariance({covariance_.data(), static_cast<std::size_t>(count * count)});
    for (int r = 0; r < kPerPatch; ++r) {
      for (int c = 0; c < kPerPatch; ++c) {
        const auto at = static_cast<std::size_t>(freed_.index(patch, r) * count + freed_.index(patch, c));
        found.covariance(r, c) +=
            share[i] / sum * (freed_.unit(patch, r) * freed_.unit(patch, c) * covariance_[at] + away[r] * away[c]);
      }
    }
  }
  return found;
}

Wrench AroundPatches::wrench(int i) {
  Wrench wrench = posterior(i).wrench();
  for (int k = 0; k < freed_.count(); ++k) {
    const RoundPatch& patch = freed_.patch(k);
    const Vector3d at(patch.place.x_m, patch.place.y_m, 0.0), force = patch.load.head<3>();
    wrench.head<3>() += force;
    wrench.tail<3>() += at.cross(force);
    wrench[5] += patch.load[3];
    // The posterior is linear about the fit: what is missing is the moment by both changes together.
    const PatchChange other = change(i, k);
    const Vector3d away(other[kPatchLoads], other[kPatchLoads + 1], 0.0);
    wrench.tail<3>() += away.cross(Vector3d(other.head<3>()));
  }
  return wrench;
}

void AroundPatches::pointForces_N(int i, std::span<double> forces) {
  posterior(i).allForces_N(moments_.mean_N);
  addUp(atoms_, moments_.mean_N, forces);
  for (int k = 0; k < freed_.count(); ++k) {
    const RoundPatch found = freed_.changed(k, change(i, k));
    spread_.divide(found.place, true);
    spread_.add(found.load, k, forces);
  }
}

}  // namespace tractiond::solve
