// Adds the roughness of contacts to the prior: the force of each atom, of any size, may differ by a share of the
// pressure beneath it.
#pragma once

#include "daemon/solve/selection.h"

namespace tractiond::solve {

/// Averages numbers of points over a distance: weights exp(-r^2 / 2 reach^2), whose sum is 1 at every point.
class Spread {
 public:
  Spread(const Atoms& atoms, double reach_m);

  /// \param from,to P numbers
  void average(const Eigen::VectorXd& from, Eigen::VectorXd& to);

 private:
  // Of a grid along x and along y, C x C and R x R; of a body between all points.
  Eigen::MatrixXd across_, along_, product_;
  Eigen::SparseMatrix<double, Eigen::RowMajor> any_;
};

/// Thread-bound. Allocates only when made.
class Roughness {
 public:
  /// `atoms` must outlive it.
  Roughness(const Atoms& atoms, const ModelOptions& options);

  /// Returns gamma of all atoms: that of the chosen ones, plus (rho_a q_a)^2 / 3 for every atom. q_a is the force of
  /// the atom under the harmonic mean of the pressure beneath it; an atom that is broader than the contact gets
  /// nothing. A point beyond the nodes has at least the pressure of the nearest node: there a contact may go on as it
  /// is at their edge. `mean_N`: of all atoms, 3A.
  std::span<const double> add(std::span<const double> mean_N, const Chosen& chosen);

  /// Returns (rho_a q_a)^2 / 3 of all atoms under the forces of the points (3P); rho_a is 1 where the picture hardly
  /// tells, elsewhere `rho`.
  std::span<const double> of(std::span<const double> pointForces_N, double rho);

  /// Returns q_a^2 / 3 of all atoms under the forces of the points (3P).
  std::span<const double> beneath(std::span<const double> pointForces_N);

 private:
  /// Levels whose pressure is averaged over the same distance.
  struct Group {
    Spread spread;
    std::vector<int> atoms;
  };

  const Atoms& atoms_;
  std::vector<Group> groups_;
  const double rho_;
  std::vector<unsigned char> isTold_;  // A: whether the picture tells what it has
  std::vector<double> largest_;        // of each atom, its largest share of a point
  std::vector<double> pointForce_;     // 3P
  Eigen::VectorXd force_, pressure_;   // P, magnitudes; then 1 / pressure
  std::vector<double> gamma_;          // A
};

}  // namespace tractiond::solve
