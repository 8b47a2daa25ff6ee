#include "touch/assignment.h"

#include <limits>

namespace touch {

std::vector<int> assign(const Eigen::MatrixXd& cost) {
  const int rows = static_cast<int>(cost.rows());
  const int columns = static_cast<int>(cost.cols());
  // Column 0 is not one of the matrix: it holds the row that is being added.
  std::vector<int> rowOf(columns + 1, -1);
  Eigen::VectorXd rowPotential = Eigen::VectorXd::Zero(rows);
  Eigen::VectorXd columnPotential = Eigen::VectorXd::Zero(columns + 1);
  for (int row = 0; row < rows; ++row) {
    // Shortest augmenting path from this row to a free column, by Dijkstra's algorithm on reduced costs.
    rowOf[0] = row;
    int at = 0;
    std::vector<double> distance(columns + 1, std::numeric_limits<double>::infinity());
    std::vector<int> before(columns + 1, 0);
    std::vector<bool> done(columns + 1, false);
    while (rowOf[at] >= 0) {
      done[at] = true;
      const int from = rowOf[at];
      int nearest = 0;
      double least = std::numeric_limits<double>::infinity();
      for (int column = 1; column <= columns; ++column) {
        if (done[column]) continue;
        const double reduced = cost(from, column - 1) - rowPotential[from] - columnPotential[column];
        if (reduced < distance[column]) {
          distance[column] = reduced;
          before[column] = at;
        }
        if (distance[column] < least) {
          least = distance[column];
          nearest = column;
        }
      }
      for (int column = 0; column <= columns; ++column) {
        if (done[column]) {
          rowPotential[rowOf[column]] += least;
          columnPotential[column] -= least;
        } else {
          distance[column] -= least;
        }
      }
      at = nearest;
    }
    for (; at != 0; at = before[at]) rowOf[at] = rowOf[before[at]];
  }
  std::vector<int> columnOf(rows, -1);
  for (int column = 1; column <= columns; ++column) {
    if (rowOf[column] >= 0) columnOf[rowOf[column]] = column - 1;
  }
  return columnOf;
}

}  // namespace touch
