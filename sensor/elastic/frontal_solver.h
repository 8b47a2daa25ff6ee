// Cholesky factorisation by fronts (Irons 1970; Duff and Reid 1983): subdomains are merged pairwise, and an unknown is
// eliminated as soon as no other subdomain knows it.
#pragma once

#include <Eigen/Core>

#include <functional>
#include <vector>

namespace sensor::elastic {

/// The equations of a subdomain: matrix x = right. `right` holds the columns firstColumn.. of the whole right-hand side
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

  /// The sum of two fronts; b's columns follow a's without a gap.
  Front merge(Front a, Front b);

  /// Expresses the unknowns for which `isDone` by the remaining ones, keeps their rows for solve().
  Front eliminate(Front front, const std::function<bool(int)>& isDone);

  /// Solution of all eliminated unknowns: unknownCount x columns; the others are zero. Consumes the factors.
  Eigen::MatrixXd solve(Eigen::Index columns);

 private:
  struct Factor {
    std::vector<int> eliminated, remaining;
    Eigen::MatrixXd diagonal;  // lower Cholesky factor of the eliminated unknowns
    Eigen::MatrixXd below;     // remaining x eliminated
    Eigen::MatrixXd right;     // forward-solved
    Eigen::Index firstColumn;
  };
  std::vector<Factor> factors_;
  std::vector<int> local_;  // scratch: row of an unknown in the front at hand, -1 if absent
};

}  // namespace sensor::elastic
