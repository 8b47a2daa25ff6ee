// One statistical model of all contacts (docs/decisions/0020-one-inverse.md): the forces of atoms of several sizes,
// each f_a ~ N(0, gamma_a Omega_a), whose priors follow the picture in a fixed number of rounds (Tipping 2001; MacKay;
// Fang et al. 2015). From nothing but the frame; nothing is kept from one frame to the next.
//
// Not the daemon's unless SolveOptions::solving says so.
#pragma once

#include "daemon/solve/amplitudes.h"
#include "daemon/solve/around_patches.h"
#include "daemon/solve/even_field.h"
#include "daemon/solve/evidence.h"
#include "daemon/solve/mixture.h"
#include "daemon/solve/posterior.h"
#include "daemon/solve/prior.h"
#include "daemon/solve/roughness.h"

#include <optional>

namespace tractiond::solve {

/// Forces are those of the object on the gel, gel frame.
struct Estimate {
  enum class Outcome {
    kNothing,  ///< no force is evident; all numbers are 0 but the motion and what it leaves
    kFound,
    kFailed,  ///< not finite, or the equations could not be solved; forces, wrench and residual are 0
  };
  Outcome outcome = Outcome::kNothing;
  std::vector<double> force_N;            ///< 3P, of Atoms::points
  std::array<double, 6> wrench{};         ///< force and moment about the origin [N, N m]
  std::array<double, 36> covariance{};    ///< of the wrench by noise and prior, row after row
  std::array<double, kMotions> motion{};  ///< of the picture, in deviations of its prior
  double squaredResidual_px2 = 0.0;       ///< of the coordinates that are there
  double degrees = 0.0;                   ///< of freedom that the forces took
  int atoms = 0;                          ///< that have a force in the field alone
  int rounds = 0;                         ///< that were done for it
  int patchCount = 0;       ///< of the patches that were compared with the field without them; 0: none were
  double evenShare = 0.0;   ///< probability that one contact presses evenly
  double patchShare = 0.0;  ///< probability that there are patches rather than the field without them
  std::array<FoundPatch, RoundPatches::kMost> patches{};
};

/// Thread-bound. Allocates only when made.
class Model {
 public:
  /// Of the field alone, without patches. All must outlive it.
  Model(const Factors& factors, const Atoms& atoms, const ModelOptions& options = {});

  /// With patches, where the sensor allows them. `sensor` is read here alone; the others must outlive it.
  Model(const sensor::Sensor& sensor, const Factors& factors, const Atoms& atoms, const ModelOptions& options = {});
  Model(const Model&) = delete;  // its parts refer to each other

  /// `displacement_px`: 2M, 0 where missing; `missing`: those coordinates, rising, pairs of whole markers; `noise_px`:
  /// of this frame. `estimate.force_N` must have 3P elements.
  void solve(std::span<const float> displacement_px, std::span<const int> missing, double noise_px,
             Estimate& estimate) noexcept;

  // Of what solve() found last; all 0 unless its outcome was kFound.

  /// Standard deviations of the forces of all nodes (3N), of noise and prior: sums of the points that are published
  /// there (Atoms::nodeOf).
  void nodeDeviations_N(std::span<double> deviations) noexcept;

  /// Computes the shares of the points (P) in the force of a patch of the estimate; its place is their centroid.
  void shares(const RoundPatch& patch, std::span<double> shares) noexcept;

  /// Covariance of `count` functionals of the points' forces, row after row. `weights`: 3P x count, row after row; at
  /// most kColumns functionals.
  void covariance(std::span<const double> weights, int count, std::span<double> covariance) noexcept;

 private:
  enum class Found { kAtoms, kNothing, kFailed };
  /// What is compared with the field alone: an even contact; round patches and the field around them.
  struct Patched {
    EvenField even;
    RoundPatches patches;
    AroundPatches around;
    LineArray<double> left, still;  // displacements that patches leave; the same without the picture's motion
    std::vector<float> stillRounded;
  };

  Found findField(const Displacements& picture, std::span<const float> displacement_px, int& rounds);
  void look(const Displacements& picture, std::span<const float> displacement_px, AtomMoments& moments);
  bool shows(const AtomMoments& moments, double surety) const;
  Found round(const Displacements& picture, int most, bool last);
  bool roughen(const Displacements& picture, int most);
  void keepMean();
  bool looksAgain(const Displacements& picture);
  void addField();
  bool findPatches(const Displacements& picture);
  void addEvenField(const Displacements& picture);
  void addPatches();
  double shareOf(int first, int end) const;
  void publishNothing(const Displacements& picture, Estimate& estimate);
  void publish(Estimate& estimate);
  static void clear(Estimate& estimate);

  const Factors& factors_;
  const Atoms& atoms_;
  const ModelOptions options_;
  Amplitudes amplitudes_;
  Evidence evidence_;
  Prior prior_;
  Selection selection_;
  Roughness roughness_;
  AtomProducts products_;
  Posterior posterior_;
  std::optional<Patched> patched_;
  Mixture mixture_;  // of the field alone, then of even contacts and of the field around patches, of each roughness
  int firstPatched_ = 0;  // of these
  // Of one frame.
  LineArray<double> displacement_;
  AtomMoments moments_, rest_;             // of all atoms: of the last round; of the residual
  std::vector<double> first_;              // A: what the last look at the modes knew
  Chosen chosen_, smooth_;                 // smooth_: before roughness
  double degrees_ = 0.0;                   // of freedom that the forces took
  std::vector<double> noise_;              // of the chosen atoms
  std::vector<double> pointForce_, left_;  // 3P; r
};

}  // namespace tractiond::solve
