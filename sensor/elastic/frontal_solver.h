// Cholesky factorisation by fronts (Irons 1970; Duff and Reid 1983): subdomains are merged pairwise, and an unknown is
// eliminated as soon as no other subdomain contains it.
#pragma once

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace sensor::elastic {

/// The equations of a subdomain, matrix * x = right. `right` holds the columns of the whole right-hand side from
/// firstColumn on that are not zero here.
struct Front {
  std::vector<int> unknowns;  ///< global numbers, in the order of the rows
  Eigen::MatrixXd matrix;     ///< symmetric; only the lower triangle is used
  Eigen::MatrixXd right;      ///< unknowns x its columns
  Eigen::Index firstColumn = 0;
};

/// Solves a sparse system: eliminate() is called for the subdomains bottom up, then solve() once. Thread-bound.
class FrontalSolver {
 public:
  /// \param unknownCount number of unknowns; their global numbers are 0 .. unknownCount - 1
  explicit FrontalSolver(int unknownCount)
      : local_(unknownCount, -1) {}

  /// Adds the equations of the parts, at least one. Eliminates the unknowns for which `isDone` holds and returns the
  /// equations of the remaining ones. The matrix of the eliminated unknowns must be positive definite (asserted).
  Front eliminate(const std::vector<Front>& parts, const std::function<bool(int)>& isDone);

  /// Returns the solution of all eliminated unknowns, unknownCount x columns; rows of other unknowns are zero. Discards
  /// the factors.
  /// \param columns number of columns of the whole right-hand side
  Eigen::MatrixXd solve(Eigen::Index columns);

 private:
  struct Factor {
    std::vector<int> eliminated, remaining;
    Eigen::MatrixXd lower;  // columns of the Cholesky factor: eliminated rows above remaining rows
    Eigen::MatrixXd right;  // right-hand sides of the eliminated unknowns, forward-solved
    Eigen::Index firstColumn = 0;
  };
  std::vector<Factor> factors_;
  std::vector<int> local_;  // row of each unknown in the current sum, else -1
};

}  // namespace sensor::elastic
