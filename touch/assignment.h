// Globally optimal assignment.
#pragma once

#include <Eigen/Core>

#include <vector>

namespace touch {

/// Returns for each row the column that it is assigned, each column to one row at most, with the least sum of costs.
/// \param cost finite, with at least as many columns as rows
/// Hungarian method with potentials, O(rows^2 columns) (Kuhn 1955, Munkres 1957).
std::vector<int> assign(const Eigen::MatrixXd& cost);

}  // namespace touch
