// Unknowns of the posterior beside the atoms' forces and the motion, each ~ N(0, 1): what one unit of each does to the
// markers, to the wrench and to the points' forces, and the products of it that the normal equations need.
//
// Products with an atom are computed when they are first asked for: all posteriors of a frame share them.
#pragma once

#include "daemon/solve/atom_products.h"

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class ExtraUnknowns {
 public:
  /// Both must outlive it.
  ExtraUnknowns(const Factors& factors, const Atoms& atoms, int most);

  /// Starts anew with `count` unknowns that do nothing.
  void begin(int count);

  /// Sets what a unit of `unknown` does to the markers: `factor` times `displacement_px` (2M, 0 where missing).
  void setDisplacement(int unknown, const double* displacement_px, double factor);

  /// What a unit of `unknown` adds to the forces of the points (3P), and to the wrench. To be filled.
  std::span<double> pointForces_N(int unknown);
  Eigen::Matrix<double, 6, 1>& wrench(int unknown) { return wrench_[static_cast<std::size_t>(unknown)]; }

  /// Computes the products among the unknowns, with the motion and with `picture`, and the nodes' forces.
  void multiply(const Displacements& picture);

  int count() const { return count_; }
  const Eigen::Matrix<double, 6, 1>& wrench(int unknown) const { return wrench_[static_cast<std::size_t>(unknown)]; }
  std::span<const double> pointForces_N(int unknown) const;
  std::span<const double> nodeForces_N(int unknown) const;  ///< of the points that are published at each node (3N)
  /// Products of an atom's components with the unknowns, then with the picture: 3 rows of stride().
  const double* productsWith(int atom);
  int stride() const { return stride_; }
  double product(int a, int b) const { return gram_[index(a, b)]; }
  double withMotion(int unknown, int motion) const {
    return withMotion_[kColumns * static_cast<std::size_t>(unknown) + motion];
  }
  /// The picture is one more column, with the index count().
  double withDisplacement(int unknown) const { return product(unknown, count_); }

 private:
  std::size_t index(int a, int b) const { return static_cast<std::size_t>(a) * static_cast<std::size_t>(stride_) + b; }
  int panels() const { return (count_ + kColumns) / kColumns; }
  double* panel(int number) {
    return columns_.data() + static_cast<std::ptrdiff_t>(number) * kColumns * factors_.influence.stride();
  }

  const Factors& factors_;
  const Atoms& atoms_;
  const int stride_;  // the most unknowns and the picture, padded to panels
  int count_ = 0;
  LineArray<double> columns_, motion_;  // panels of kColumns columns, row after row
  std::vector<Eigen::Matrix<double, 6, 1>> wrench_;
  std::vector<double> pointForces_;   // most x 3P
  std::vector<double> nodeForces_;    // most x 3N
  std::vector<double> gram_;          // stride x stride
  std::vector<double> withMotion_;    // stride x kColumns: with the motion
  std::vector<double> withAtoms_;     // 3A x stride
  std::vector<unsigned char> asked_;  // A: whether its products are there
};

}  // namespace tractiond::solve
