// Reads what a picture shows of the modes, as far as it is needed: first the strongest, which tell whether anything
// touches. The rounds start with the same prior for all atoms, f ~ N(0, tau^2). tau maximises the evidence of the
// picture's amplitudes c in the modes s:
//   -1/2 sum [ln(s^2 tau^2 + n^2) + c^2 / (s^2 tau^2 + n^2)]
// The modes are read in groups (ModelConstants::kGroups), as long as forces of that size are visible in the next group:
// its strongest mode has s tau >= epsilon n, where epsilon is ModelConstants::kVisible. Groups in which the final tau
// is not visible are left out.
#pragma once

#include "daemon/solve/amplitudes.h"
#include "daemon/solve/atom_moments.h"
#include "daemon/solve/atom_products.h"

#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// The force that alone explains a picture best: of one atom, by least squares.
struct BestForce {
  double squaredDeviations = 0.0;  ///< by how much it reduces the squared residual [n^2]; chi^2 of 3 degrees by noise
  int atom = 0;
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
};

/// Returns the deviations of BestForce that noise reaches in a share `falseAlarms` of the pictures; 0 if it is 1 or
/// more. A quarter of the `atoms` counts as independent (docs/mathematics.md, 4.2).
double detectionThreshold(double falseAlarms, int atoms);

/// Replaces the moments of an atom by a force that is evident: it has no noise.
void makeEvident(const BestForce& force, AtomMoments& moments);

/// Thread-bound. Allocates only when made.
class Modes {
 public:
  /// `factors` and `atoms` must outlive it. A copy, for another thread, shares the tables.
  Modes(const Factors& factors, const Atoms& atoms, const SolveOptions& options);

  /// Reads the strongest modes of a picture and completes what is missing. Returns the force that alone explains it
  /// best. What `picture` borrows must live until the next look().
  const BestForce& look(const Displacements& picture);
  /// Does what look() does, and returns whether anything touches. The force must be as sure by the noise of the markers
  /// that show it: the equations weigh all markers alike, and where the light is uneven, the noise of the dark ones
  /// alone would pass for a touch.
  /// \param variance_px2 M, of a coordinate of each marker, 0 if missing; empty: all are alike
  bool detect(const Displacements& picture, std::span<const float> variance_px2);

  /// Reads all modes in which that picture's forces are visible, and computes the moments of all atoms, all alike, with
  /// the prior of the likeliest tau: of fixed values, 28 % apart, from 6e-6 to 1.6 times Factors::force_N, in
  /// proportion to noise_px / SolveOptions::noise_px, but at least the magnitude of the most significant force /
  /// sqrt(3P). If the most significant atom is ambiguous, and as sure as ModelConstants::kBroad, it is made evident: a
  /// broad contact is divided among so many atoms that few of them are, or none.
  void start(AtomMoments& moments);
  /// Does the same with what forces of the points (3P) leave of the modes that were read, if that shows an atom by
  /// ModelConstants::kSignificance. Returns whether it does.
  bool startBeside(std::span<const double> forces_N, AtomMoments& moments);

  const BestForce& best() const { return best_; }  ///< Returns the result of the last look() or detect().
  /// Returns what the picture of that call showed of each atom: V_a' S c, c the picture's amplitudes (3A [px^2/N]).
  std::span<const double> matched() const { return matched_; }
  /// Returns the displacements with which its missing coordinates were completed, in their order [px].
  std::span<const double> completed() const { return amplitudes_.completed(); }
  /// Returns the tables of the strongest modes, which may be shared.
  const std::shared_ptr<const StrongModes>& strong() const { return strong_; }

 private:
  /// What depends on factors, atoms and the calibrated noise alone. For each tau / n: 1 / (s^2 tau^2 / n^2 + 1) of
  /// every mode, and the sum of the logarithms up to it; of every atom AtomMoments::known, and the inverse covariance
  /// of the mean at 1 px of noise, by the visible groups.
  struct Tables {
    std::vector<int> ends;  // of the groups of modes
    std::vector<double> ratios;
    std::vector<int> used;                      // modes of the visible groups
    Eigen::MatrixXd unexplained, logarithms;    // r x ratios
    Eigen::MatrixXd known;                      // A x ratios
    std::vector<std::vector<Block>> precision;  // ratios x A
    std::vector<Block> alone;                   // A: (H_a' W H_a)^-1 of the modes of the first group
    Eigen::Matrix4d motionOf;                   // (Q^1/2' P' P Q^1/2 + n^2)^-1, with the calibrated n [1/px^2]
  };

  bool readMore(double least_N);
  void complete();
  BestForce bestOf(std::span<const double> amplitudes);
  BestForce aloneWith(int atom) const;
  void confirm(std::span<const float> variance_px2);
  double noiseWhereShown(const BestForce& force, std::span<const float> variance_px2) const;
  double leastTypical_N(const BestForce& force) const;
  int likeliest(std::span<const double> amplitudes, double least_N);
  void startWith(std::span<const double> amplitudes, const BestForce& force, AtomMoments& moments);
  const RowMatrix& right(int modes) const;
  void addUpModes(int used, std::vector<double>& sums);
  static int lastVisible(const Factors& factors, const Tables& tables, double ratio);
  static void tabulate(const Factors& factors, const Atoms& atoms, Tables& tables);

  const Factors& factors_;
  const Atoms& atoms_;
  const double detection_;  ///< deviations of the most significant force below which nothing touches
  const std::shared_ptr<const StrongModes> strong_;
  std::shared_ptr<const Tables> tables_;
  // Of one picture.
  Amplitudes amplitudes_;
  BestForce best_;
  double noise_px_ = 0.0;
  bool isMissing_ = false;           // some coordinates are
  std::vector<double> matched_;      // 3A: H_a' W d
  std::vector<int> everyPoint_;      // 0 .. 3P-1
  std::vector<double> power_;        // r: squared amplitudes [px^2]
  std::vector<double> left_;         // r: amplitudes of startBeside()
  LineArray<double> filtered_;       // of each mode [N], padded
  std::vector<double> pointMean_;    // 3P [N]
  std::vector<float> coefficients_;  // 3P
};

}  // namespace tractiond::solve
