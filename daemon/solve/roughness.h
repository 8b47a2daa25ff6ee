// Adds to the prior what the forces that were found do not say: the force of each atom, of any size, may differ by a
// share of the pressure beneath it, and a contact may continue around them, too faint to be evident.
#pragma once

#include "daemon/solve/selection.h"

namespace tractiond::solve {

/// Averages numbers of points over a distance, with the weights exp(-r^2 / 2 reach^2), whose sum is 1 at every point.
class Spread {
 public:
  /// Uses `atoms` in the constructor only.
  /// \param reach_m above 0
  Spread(const Atoms& atoms, double reach_m);

  /// Computes the averages.
  /// \param from, to P numbers each, which must not overlap
  void average(const Eigen::VectorXd& from, Eigen::VectorXd& to);

 private:
  // Of a grid along x and along y, C x C and R x R; of a body between all points.
  Eigen::MatrixXd across_, along_, product_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> any_;
};

/// Thread-bound. Allocates only when made.
class Roughness {
 public:
  /// `atoms` must outlive it; `factors` is used in the constructor only.
  Roughness(const Factors& factors, const Atoms& atoms);

  // The results are valid until the next call of any of these functions. q_a is the force that an atom has under the
  // harmonic mean of the pressure beneath it; it is about 0 for an atom that is broader than the contact. The forces
  // must not all be 0 (asserted).

  /// Returns gamma of all atoms (A [N^2]): that of the chosen ones, plus (rho_a q_a)^2 / 3 for every atom, plus, for
  /// the atoms that are larger than points (of a body, for all), what may be unseen: the same with rho = 1, of the
  /// pressure averaged over ModelConstants::kAround more, but no more than is expected to displace the markers, all
  /// together, by `unseen_px`. A point beyond the nodes has at least the pressure of the nearest node, as a contact may
  /// continue there.
  /// \param mean_N forces of all atoms, 3A
  std::span<const double> add(std::span<const double> mean_N, const Chosen& chosen, double unseen_px);

  /// Returns (rho_a q_a)^2 / 3 of all atoms (A [N^2]) under the forces of the points (3P), continued as above. rho_a is
  /// `rho`, or 1 for points beyond the nodes and for ambiguous levels.
  std::span<const double> of(std::span<const double> pointForces_N, double rho);

  /// Returns q_a^2 / 3 of all atoms (A [N^2]) under the forces of round patches, spread over the points (3P [N]:
  /// x, y, z of each point). A patch is known to end: points beyond the nodes have their own pressure.
  std::span<const double> ofPatches(std::span<const double> pointForces_N);

 private:
  /// Levels whose pressure is averaged over the same distance.
  struct Group {
    double reach_m = 0.0;
    Spread spread;
    std::vector<int> atoms;
  };

  void addTo(std::vector<Group>& groups, const Level& level, double reach_m);
  void beneath(std::span<const double> pointForces_N, bool continues, std::vector<Group>& groups,
               std::span<double> gamma);

  const Atoms& atoms_;
  std::vector<Group> groups_, around_;  // of all levels; of the levels that may be unseen
  std::vector<unsigned char> isTold_;   // A: whether the picture tells what it has
  std::vector<double> largest_;         // of each atom, its largest share of a point
  std::vector<double> pointForce_;      // 3P
  Eigen::VectorXd force_, pressure_;    // P, magnitudes; then 1 / pressure
  std::vector<double> gamma_;           // A
  std::vector<double> unseen_;          // A: likewise, of around_; of other levels 0
  std::vector<double> mostUnseen_;      // A: its largest, for unseen_px = 1
};

}  // namespace tractiond::solve
