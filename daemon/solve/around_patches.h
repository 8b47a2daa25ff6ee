// Computes the field around round patches (docs/mathematics.md, 4.4). The rounds that choose atoms run on the
// displacements without those of the patches, whose loads and places may still change. Then one posterior of atoms and
// patches is computed for each roughness of the patches.
#pragma once

#include "daemon/solve/freed_patches.h"
#include "daemon/solve/patch_spread.h"
#include "daemon/solve/posterior.h"

namespace tractiond::solve {

/// A round contact of the estimate. Its load excludes its roughness and the field around it.
struct FoundPatch {
  RoundPatch patch;
  int contact = 0;  ///< the first patch of the same contact, set by Model if Estimate::patchShare > 1/2; else 0
  /// Covariance of force, torsion, x, y, spread [N, N m, m, m, m^2].
  Eigen::Matrix<double, kPerPatch, kPerPatch> covariance = decltype(covariance)::Zero();
  SpreadRatio spreadRatio;  ///< known of answers by an earlier model alone
};

/// Thread-bound. Allocates only when made.
class AroundPatches {
 public:
  static_assert(kCouples == RoundPatches::kMost);

  /// Values of rho (ModelConstants::kRoughness) of the patches that are tried; equally probable a priori.
  static constexpr std::array kRoughness = {0.1, 0.2, 0.4, 0.8};

  /// All references must outlive it.
  AroundPatches(const Factors& factors, const Atoms& atoms, Prior& prior, Selection& selection, Roughness& roughness);

  /// Solves for the field. Returns false if equations could not be solved; the results then have no meaning.
  /// \param left RoundPatches::leave() with the motion
  /// \param products with the same missing coordinates
  /// \param start moments of the atoms by the modes of RoundPatches::leave() without the motion
  bool solve(const Displacements& left, AtomProducts& products, const AtomMoments& start, const RoundPatches& patches);

  // Results of solve() with the roughness kRoughness[i].

  /// Returns the posterior of the atoms and, as extra unknowns, of the changes of the patches. Valid until the next
  /// solve().
  Posterior& posterior(int i) { return solutions_[i].posterior; }
  /// Returns the log evidence, reduced for the free places of the patches and for the choice of roughness, but not for
  /// the fitted prior of its atoms. To be compared with Posterior::logEvidence() of the field alone, less kOptimism for
  /// each degree of freedom.
  double logEvidence(int i) { return posterior(i).logEvidence() - occam_; }
  /// Returns force and moment of atoms and patches about the origin of the gel frame [N, N m].
  Wrench wrench(int i);
  /// Computes the forces of the points and the couples (3 (P + kCouples)). The force of a patch is spread over the
  /// points beneath it, so that their centroid is its place.
  void pointForces_N(int i, std::span<double> forces);

  /// Returns the patches of the last solve(), and what frees them.
  const FreedPatches& freed() const { return freed_; }
  /// Returns a patch with its mean over all roughnesses, weighted by their evidence.
  /// \param patch below freed().count()
  FoundPatch found(int patch);

 private:
  void setExtra(const Displacements& left, const RoundPatches& patches);
  /// Does the rounds on what is `left` and sets smooth_, all 0 if no atom is evident. Returns false if equations could
  /// not be solved.
  bool findEvident(const Displacements& left, AtomProducts& products, const AtomMoments& start);
  bool roughen(const Displacements& left, AtomProducts& products);
  void keep(const AtomMoments& start);
  PatchChange change(int i, int patch) { return freed_.change(patch, posterior(i).extra()); }

  static constexpr int kMostAtoms = ModelConstants::kMost[0].back();

  const Atoms& atoms_;
  Prior& prior_;
  Selection& selection_;
  Roughness& roughness_;
  std::vector<ChosenPosterior> solutions_;  // of each roughness; the first one's are those of the rounds, too
  PatchSpread spread_;
  ExtraUnknowns extra_;
  // Of one frame.
  FreedPatches freed_;
  double occam_ = 0.0;
  AtomMoments moments_;
  std::vector<double> smooth_;  // A: gamma of the atoms of the last round
  std::vector<double> rough_;   // A: gamma of the patches at rho = 1
  std::vector<double> whole_;   // A: gamma of both
  std::vector<double> noise_;   // of the chosen atoms
  Eigen::VectorXd here_;        // 3 (P + kCouples): forces of a patch
  std::array<double, kMostFreed * kMostFreed> covariance_{};
};

}  // namespace tractiond::solve
