// Cholesky factorisation by fronts (Irons 1970; Duff and Reid 1983): subdomains are merged pairwise, and an unknown is
// eliminated as soon as no other subdomain knows it.
#pragma once

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace sensor::elastic {

/// The equations of a subdomain, matrix x = right. `right` holds the columns firstColumn.. of the whole right-hand side
/// that are not zero here.
struct Front {
  std::vector<int> unknowns;  ///< global numbers, in the order of the rows
  Eigen::MatrixXd matrix;     ///< symmetric, lower triangle
  Eigen::MatrixXd right;
  Eigen::Index firstColumn = 0;
};

/// Feed it fronts bottom up, then solve. Thread-bound.
class FrontalSolver {
 public:
  explicit FrontalSolver(int unknownCount)
      : local_(unknownCount, -1) {}

  /// Adds the parts (columns of each follow those of the one before without a gap), expresses the unknowns for which
  /// `isDone` by the remaining ones and returns the equations of these.
  Front eliminate(const std::vector<Front>& parts, const std::function<bool(int)>& isDone);

  /// Solution of all eliminated unknowns: unknownCount x columns; the others are zero. Consumes the factors.
  Eigen::MatrixXd solve(Eigen::Index columns);

 private:
  struct Factor {
    std::vector<int> eliminated, remaining;
    Eigen::MatrixXd lower;  // columns of the Cholesky factor: eliminated above remaining rows
    Eigen::MatrixXd right;  // of the eliminated, forward-solved
    Eigen::Index firstColumn = 0;
  };
  std::vector<Factor> factors_;
  std::vector<int> local_;  // scratch: row of an unknown in the sum at hand, else -1
};

}  // namespace sensor::elastic
