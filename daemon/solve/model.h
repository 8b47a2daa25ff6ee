// Estimates forces by one statistical model of all contacts (docs/mathematics.md, section 4). Atoms of several
// sizes have forces f_a ~ N(0, gamma_a Omega_a), whose priors are fitted to the picture in a fixed number of rounds
// (Tipping 2001; MacKay; Fang et al. 2015). Each frame is solved on its own: nothing is kept for the next one.
#pragma once

#include "daemon/solve/around_patches.h"
#include "daemon/solve/even_field.h"
#include "daemon/solve/mixture.h"
#include "daemon/solve/modes.h"
#include "daemon/solve/posterior.h"
#include "daemon/solve/prior.h"
#include "daemon/solve/roughness.h"

#include <optional>

namespace tractiond::solve {

/// Result of Model::solve(). Forces are those of the object on the gel, in the gel frame.
struct Estimate {
  enum class Outcome {
    kNothing,  ///< no force is evident; all numbers but motion, residual and rounds are 0
    kFound,
    kFailed,  ///< displacements not finite, or the equations could not be solved; all numbers but rounds are 0
  };
  Outcome outcome = Outcome::kNothing;
  std::vector<double> force_N;                   ///< 3P, of Atoms::points
  std::array<double, 3 * kCouples> couple_Nm{};  ///< of each patch, besides the forces of the points
  Wrench wrench = Wrench::Zero();                ///< force and moment about the origin [N, N m]
  std::array<double, 36> covariance{};           ///< of the wrench by noise and prior, row after row
  std::array<double, kMotions> motion{};         ///< of the picture, in deviations of its prior
  double squaredResidual_px2 = 0.0;              ///< sum over the coordinates not missing; rounding may make it < 0
  int atoms = 0;                                 ///< number of atoms with a force in the field without patches
  int rounds = 0;                                ///< number of rounds that were needed for it
  int patchCount = 0;                            ///< number of `patches`; 0: they have no probability
  double evenShare = 0.0;                        ///< probability that one contact presses evenly
  double patchShare = 0.0;  ///< probability that there are patches rather than the field without them
  std::array<FoundPatch, RoundPatches::kMost> patches{};
};

/// Sets what an estimate takes from the mixture that it is the mean of; its other numbers stay as they are.
void takeMeans(Mixture& mixture, Estimate& estimate);

/// Sets what an estimate, which must be clear, says of a picture that nothing touches.
/// \param products of the picture
void explainByMotion(const Displacements& picture, AtomProducts& products, Posterior& posterior, Estimate& estimate);

/// Thread-bound. Allocates only when made.
class Model {
 public:
  /// Makes a model without patches and even contacts. `factors` and `atoms` must outlive it.
  Model(const Factors& factors, const Atoms& atoms, const SolveOptions& options = {});

  /// Makes a model with patches and even contacts, if PatchInfluence::possible(). `factors` and `atoms` must outlive
  /// it; `sensor` is used by the constructor only.
  Model(const sensor::Sensor& sensor, const Factors& factors, const Atoms& atoms, const SolveOptions& options = {});
  Model(const Model&) = delete;  // its parts refer to each other

  /// Estimates the forces. `estimate.force_N` must have 3P elements. Errors are reported by Estimate::outcome only.
  /// \param picture what it borrows must live until the next solve(); both coordinates of a marker are missing, or none
  /// \param variance_px2 M, of a coordinate of each marker, 0 if missing: what is detected must be so by these as well;
  /// empty: all are alike
  void solve(const Displacements& picture, Estimate& estimate, std::span<const float> variance_px2 = {}) noexcept;

  /// A candidate of the mixture.
  struct Solved {
    Posterior* posterior = nullptr;
    double penalty = 0.0;  ///< what its worth lacks of the log evidence of the posterior
  };

  /// Sets all numbers of an estimate to 0.
  static void clear(Estimate& estimate);

  // Results of the last solve().

  /// Returns what the estimate is the mean of, with its covariances; empty unless the outcome was kFound.
  Mixture& mixture() { return mixture_; }
  /// Returns what the i-th candidate of the mixture was solved from.
  const Solved& solved(int i) const { return solved_[i]; }
  /// Returns what looks at a picture first.
  const Modes& modes() const { return modes_; }
  /// Returns the products of the picture's atoms.
  AtomProducts& products() { return products_; }
  /// Returns the patches of the candidates that have some, and their extra unknowns. Must not be called for a model
  /// without patches.
  const RoundPatches& patches() const { return patched_->patches; }
  const FreedPatches& freed() const { return patched_->around.freed(); }
  /// Returns the picture that was given to solve().
  const Displacements& picture() const { return picture_; }

 private:
  using Outcome = Estimate::Outcome;
  /// What is compared with the field alone: an even contact; round patches and the field around them.
  struct Patched {
    EvenField even;
    RoundPatches patches;
    AroundPatches around;
    LineArray<double> left, still;  // displacements that patches leave; the same without the picture's motion
    std::vector<float> stillRounded;
  };

  Outcome findCandidates(std::span<const float> variance_px2, int& rounds);
  Outcome findField(int& rounds);
  Outcome round(int most, bool last);
  bool choose(int most);
  bool roughen(int most);
  bool detectInResidual();
  void addField();
  bool findOnePatch();
  bool findPatches();
  bool leavePatches();
  const BestForce& lookBesidePatches();
  bool solveAroundPatches();
  std::span<double> add(Posterior& posterior, Mixture::Kind kind, double logEvidence, const Wrench& wrench);
  void addEvenField();
  void addPatches();
  void publish(Estimate& estimate);

  const Factors& factors_;
  const Atoms& atoms_;
  Modes modes_;
  Prior prior_;
  Selection selection_;
  Roughness roughness_;
  AtomProducts products_;
  Posterior posterior_;
  std::optional<Patched> patched_;
  Mixture mixture_;             // of the field alone, of that around patches and of even contacts, of each roughness
  std::vector<Solved> solved_;  // of the mixture
  // Of one frame.
  Displacements picture_;
  AtomMoments moments_, rest_;        // of all atoms: of the last round; of the residual
  std::vector<double> first_;         // A: AtomMoments::known of the last start()
  Chosen chosen_, smooth_;            // smooth_: before roughness
  double degrees_ = 0.0;              // degrees of freedom that the forces use
  std::vector<double> noise_;         // of the chosen atoms
  std::vector<double> pointForce_;    // 3P
  std::vector<double> evidentForce_;  // 3P: of the last round, before what may be unseen
};

}  // namespace tractiond::solve
