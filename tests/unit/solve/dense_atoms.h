// The atoms of the dense twin (dense_model.h), straight from docs/mathematics.md, section 4.
#pragma once

#include "tests/unit/solve/sensors.h"

#include <Eigen/Core>

#include <vector>

namespace tractiond::solve {

class DenseAtoms {
 public:
  using Matrix = Eigen::MatrixXd;
  using Vector = Eigen::VectorXd;

  explicit DenseAtoms(const sensor::NodeGrid& nodes);

  /// The nodes and two rings around them, row after row.
  static sensor::Points pointsOf(const sensor::NodeGrid& nodes);

 protected:
  static Matrix kronecker(const Matrix& shape);

  double squaredDistance(std::size_t a, std::size_t b) const;
  bool isAmbiguous(Eigen::Index atom) const { return level_[static_cast<std::size_t>(atom)] >= 3; }

  sensor::Points points_;
  Matrix shape_;  // points x atoms
  std::vector<double> x_, y_, spacing_;
  std::vector<int> level_;
  Eigen::Index plate_ = 0;
  Eigen::Array<bool, Eigen::Dynamic, 1> beyond_;  // of each point, whether it is none of the nodes
  std::vector<Eigen::Index> nearest_;             // of each point, the point on the nearest node
};

}  // namespace tractiond::solve
