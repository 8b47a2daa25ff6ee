// Starts the rounds with the same prior for all atoms, f ~ N(0, tau^2). tau maximises the evidence of the picture's
// amplitudes c in the modes s:
//   -1/2 sum [ln(s^2 tau^2 + n^2) + c^2 / (s^2 tau^2 + n^2)]
// The modes are read in groups (ModelOptions::groups), as long as forces of that size are visible in the next group:
// its strongest mode has s tau >= epsilon n, where epsilon is ModelOptions::visible. Groups in which the final tau is
// not visible are left out.
#pragma once

#include "daemon/solve/strong_modes.h"

#include <memory>
#include <span>
#include <vector>

namespace tractiond::solve {

/// Posterior moments of the forces of all A atoms.
struct AtomMoments {
  std::vector<double> mean_N;    ///< 3A
  std::vector<double> known;     ///< A: degrees of freedom, 3 - tr(posterior covariance) / prior variance
  std::vector<double> noise_N2;  ///< A: variance of the mean by the picture's noise, sum of the components
};

/// Sizes the arrays for a number of atoms; sets all elements to 0.
void resize(AtomMoments& moments, int atoms);

/// Returns |mean|^2 of an atom [N^2].
inline double squaredMean(const AtomMoments& moments, int atom) {
  return Eigen::Vector3d::Map(moments.mean_N.data() + 3 * static_cast<std::ptrdiff_t>(atom)).squaredNorm();
}

/// Returns e of an atom [N^2]: |mean|^2 - surety^2 noise / 3, but at least 0.
inline double evident(const AtomMoments& moments, int atom, double surety) {
  return std::max(0.0, squaredMean(moments, atom) - surety * surety * moments.noise_N2[atom] / 3.0);
}

/// The force that alone explains a picture best: of one atom, by least squares.
struct SurestForce {
  double squaredDeviations = 0.0;  ///< by how much it reduces the squared residual [n^2]; chi^2 of 3 degrees by noise
  int atom = 0;
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
};

/// Returns the deviations of SurestForce that noise reaches in a share `falseAlarms` of the pictures; 0 if it is 1 or
/// more. A quarter of the `atoms` counts as independent (docs/mathematics.md, 4.2).
double detectionThreshold(double falseAlarms, int atoms);

/// Replaces the moments of an atom by a force that is evident: it has no noise.
void makeEvident(const SurestForce& force, AtomMoments& moments);

/// Thread-bound. Allocates only when made.
class Evidence {
 public:
  /// `factors` and `atoms` must outlive it.
  Evidence(const Factors& factors, const Atoms& atoms, const ModelOptions& options,
           std::shared_ptr<const StrongModes> strong);
  /// Makes another one, for another thread, of the same factors, atoms and options.
  Evidence(const Evidence& other);

  /// Returns how many modes a frame needs: as many as `amplitudes` has, or those of one more group; without amplitudes,
  /// those of the first group. \param amplitudes c of the modes that were read [px] \param least_N as in start()
  int modesToRead(std::span<const double> amplitudes, double noise_px, double least_N);

  /// Finds the surest force, by the modes of the first group. \param amplitudes c of these modes at least [px]
  SurestForce surest(std::span<const double> amplitudes, double noise_px);
  /// Returns what the amplitudes of the last surest() match of each atom: V_a' S c (3A [px^2/N]).
  std::span<const double> matched() const { return matched_; }

  /// Returns `surest` of the last surest() if it is less sure than `deviations`; else the one that is surest by the
  /// noise of the markers that show it. The equations weigh all markers alike: where the light is uneven, the noise of
  /// the dark ones alone would pass for a touch. \param variance_px2 M, of a coordinate of each marker, 0 if missing;
  /// empty: all are alike
  SurestForce confirmed(const SurestForce& surest, double noise_px, double deviations,
                        std::span<const float> variance_px2) const;

  /// Returns the least typical force of a picture that shows this one [N]: its magnitude / sqrt(3P).
  double leastTypical_N(const SurestForce& force) const;

  /// Returns tau, the typical force of this picture [N]: the likeliest of fixed values, 28 % apart, from 6e-6 to 1.6
  /// times Factors::force_N, in proportion to noise_px / ModelOptions::noise_px. \param amplitudes c of the modes that
  /// were read [px], at least one (asserted)
  double typicalForce_N(std::span<const double> amplitudes, double noise_px);

  /// Computes the moments of all atoms from the amplitudes, with the prior of their typicalForce_N(), but at least of
  /// leastTypical_N(surest). If the surest atom is ambiguous, and as sure as ModelOptions::broad, it is made evident:
  /// a broad contact is divided among so many atoms that few of them are, or none. \param amplitudes as many as
  /// modesToRead() asks for \param surest force of the same picture
  void start(std::span<const double> amplitudes, double noise_px, const SurestForce& surest, AtomMoments& moments);

  /// Subtracts from the amplitudes, of the first modes, at most r [px], those that the forces of the points (3P) cause.
  void subtract(std::span<const double> forces_N, std::span<double> amplitudes);

 private:
  /// What depends on factors, atoms and options alone. For each tau / n: 1 / (s^2 tau^2 / n^2 + 1) of every mode, and
  /// the sum of the logarithms up to it; of every atom AtomMoments::known, and the inverse covariance of the mean at
  /// 1 px of noise, by the visible groups.
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

  SurestForce aloneWith(int atom, double noise_px) const;
  double noiseWhereShown(const SurestForce& force, std::span<const float> variance_px2) const;
  int likeliest(std::span<const double> amplitudes, double noise_px, double least_N);
  void makeRoom();
  const RowMatrix& right(int modes) const;
  void addUpModes(int used, std::vector<double>& sums);
  static int lastVisible(const Factors& factors, const Tables& tables, double ratio, double visible);
  static void tabulate(const Factors& factors, const Atoms& atoms, Tables& tables);

  const Factors& factors_;
  const Atoms& atoms_;
  const std::shared_ptr<const StrongModes> strong_;
  const double visible_, broad_;
  std::shared_ptr<const Tables> tables_;
  // Of one picture.
  std::vector<double> matched_;      // 3A: H_a' W d
  std::vector<int> everyPoint_;      // 0 .. 3P-1
  std::vector<double> power_;        // r: squared amplitudes [px^2]
  LineArray<double> filtered_;       // of each mode [N], padded
  std::vector<double> pointMean_;    // 3P [N]
  std::vector<float> coefficients_;  // 3P
};

}  // namespace tractiond::solve
