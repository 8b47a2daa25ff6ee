// The field around round patches (docs/decisions/0020-one-inverse.md): the rounds on what they leave, with the patches
// free to follow, then one posterior of everything for each roughness of the patches.
#pragma once

#include "daemon/solve/posterior.h"
#include "daemon/solve/round_patches.h"

namespace tractiond::solve {

/// A round contact within what was found; its roughness and what lies around it are not in its load.
struct FoundPatch {
  RoundPatch patch;
  int contact = 0;  ///< the first patch of the same contact; told if patches are likelier than the field alone
  /// Of force, torsion, x, y, spread [N, N m, m, m, m^2], if there are patches at all.
  Eigen::Matrix<double, kPatchLoads + kPatchPlaces, kPatchLoads + kPatchPlaces> covariance =
      decltype(covariance)::Zero();
};

/// Thread-bound. Allocates only when made.
class AroundPatches {
 public:
  /// rho of the patches, all alike before the picture.
  static constexpr std::array kRoughness = {0.1, 0.2, 0.4, 0.8};
  static constexpr int kPerPatch = kPatchLoads + kPatchPlaces;
  static constexpr int kMostExtra = kPerPatch * RoundPatches::kMost;

  /// All must outlive it.
  AroundPatches(const Factors& factors, const Atoms& atoms, const ModelOptions& options, Prior& prior,
                Selection& selection, Roughness& roughness);

  /// `left`: the displacements without the patches', motion included; `products`: with the same coordinates missing;
  /// `start`: what the modes tell of `left` without the motion. All must last. False: equations could not be solved.
  bool solve(const Displacements& left, AtomProducts& products, const AtomMoments& start, const RoundPatches& patches);

  // What solve() found with roughness `i`.
  Posterior& posterior(int i) { return solutions_[static_cast<std::size_t>(i)].posterior; }
  /// Log evidence less what the patches' freedom to be anywhere and the choice of roughness cost.
  double logEvidence(int i) { return posterior(i).logEvidence() - occam_; }
  std::array<double, 6> wrench(int i);
  /// Forces of the points (3P); a patch's own force is spread over those beneath it, their centroid being its place.
  void pointForces_N(int i, std::span<double> forces);

  int patchCount() const { return static_cast<int>(patches_.size()); }
  /// The mean of a patch over all roughnesses.
  FoundPatch found(int patch);

  /// Computes the shares of the points (P) in the force of a patch, their sum being 1. `centred`: with the patch's
  /// place as their centroid.
  void spread(const PatchPlace& place, bool centred, std::span<double> share);

 private:
  using PatchVector = Eigen::Matrix<double, kPerPatch, 1>;
  struct Solution {
    Chosen chosen;
    Posterior posterior;
  };

  void setExtra(const Displacements& left, const RoundPatches& patches);
  bool findEvident(const Displacements& left, AtomProducts& products, const AtomMoments& start);
  bool roughen(const Displacements& left, AtomProducts& products);
  void keep(const AtomMoments& start);
  PatchVector change(int i, int patch);
  double unit(int k, int i) const;
  int extra(int k, int i) const;

  const Factors& factors_;
  const Atoms& atoms_;
  const ModelOptions options_;
  Prior& prior_;
  Selection& selection_;
  Roughness& roughness_;
  std::vector<Solution> solutions_;  // of each roughness; the first one's are those of the rounds, too
  ExtraUnknowns extra_;
  // Of one frame.
  std::span<const RoundPatch> patches_;
  double occam_ = 0.0;
  AtomMoments moments_;
  Chosen evident_;                            // atoms of the last round
  std::vector<double> smooth_;                // A: gamma of these
  std::vector<double> rough_;                 // A: gamma of the patches at rho = 1
  std::vector<double> whole_;                 // A: gamma of both
  std::vector<double> noise_;                 // of the chosen atoms
  std::vector<double> share_, movedShare_;    // P
  std::array<std::vector<double>, 2> along_;  // of the columns and rows of points
  std::array<double, static_cast<std::size_t>(kMostExtra* kMostExtra)> covariance_{};
};

}  // namespace tractiond::solve
