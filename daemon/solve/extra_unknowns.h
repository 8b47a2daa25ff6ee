// Keeps the unknowns of the posterior besides the atoms' forces and the motion, each ~ N(0, 1): the effect of one unit
// on the markers, on the wrench and on the points' forces, and its products for the normal equations.
//
// Products with an atom are computed when they are first needed: all posteriors of a frame share them.
#pragma once

#include "daemon/solve/atom_products.h"
#include "daemon/solve/wrench.h"

namespace tractiond::solve {

/// Thread-bound. Allocates only when made.
class ExtraUnknowns {
 public:
  /// Makes room for `most` unknowns. `factors` and `atoms` must outlive it.
  ExtraUnknowns(const Factors& factors, const Atoms& atoms, int most);

  /// Starts anew with `count` unknowns that have no effect.
  void begin(int count);

  // For the caller, between begin() and multiply(): the effect of one unit of an unknown.

  /// Sets the effect on the markers: `factor` times `displacement_px` (2M, 0 where missing).
  void setDisplacement(int unknown, const double* displacement_px, double factor);
  /// Returns the effect on the forces of the points and on the couples (3 (P + kCouples)), which the caller fills in.
  std::span<double> pointForces_N(int unknown) {
    return std::span(pointForces_).subspan(unknown * ofPoints_, ofPoints_);
  }
  /// Returns the effect on force and moment about the origin [N, N m], which the caller fills in.
  Wrench& wrench(int unknown) { return wrench_[unknown]; }

  /// Computes the products among the unknowns, with the motion and with `picture`, and the nodes' forces. To be called
  /// once after begin(): productsWith() keeps what it has computed until the next begin().
  void multiply(const Displacements& picture);

  // For the posterior, after multiply().

  int count() const { return count_; }  ///< Returns the number of unknowns, as given to begin().
  /// Returns what the caller has filled in before.
  const Wrench& wrench(int unknown) const { return wrench_[unknown]; }
  std::span<const double> pointForces_N(int unknown) const {
    return std::span(pointForces_).subspan(unknown * ofPoints_, ofPoints_);
  }
  /// Returns the effect on the forces of the points that are published at each node (3N).
  std::span<const double> nodeForces_N(int unknown) const {
    return std::span(nodeForces_).subspan(unknown * ofNodes_, ofNodes_);
  }
  /// Returns the products of an atom's components with the unknowns, then with the picture: 3 rows of stride().
  /// Computes them at the first call for the atom.
  const double* productsWith(int atom);
  int stride() const { return stride_; }  ///< Returns the elements of a row of productsWith().
  /// Copies the displacements (2M [px]).
  void displacement(int unknown, float* to) const;
  /// Returns the product of the displacements of two unknowns [px^2].
  double product(int a, int b) const { return gram_[index(a, b)]; }
  /// Returns the product of an unknown with one of the kMotions columns of P Q^1/2 [px^2].
  double withMotion(int unknown, int motion) const { return withMotion_[kColumns * unknown + motion]; }
  /// Returns the product of an unknown with the picture [px^2], which is one more column, with the index count().
  double withDisplacement(int unknown) const { return product(unknown, count_); }

 private:
  std::size_t index(int a, int b) const { return a * stride_ + b; }
  int panels() const { return (count_ + kColumns) / kColumns; }
  std::ptrdiff_t panelAt(int number) const { return std::ptrdiff_t{kColumns} * number * factors_.influence.stride(); }
  double* panel(int number) { return columns_.data() + panelAt(number); }

  const Factors& factors_;
  const Atoms& atoms_;
  const std::size_t ofPoints_, ofNodes_;  // 3 (P + kCouples), 3N
  const int stride_;                      // the most unknowns and the picture, padded to panels
  int count_ = 0;
  LineArray<double> columns_, motion_;  // panels of kColumns columns, row after row
  std::vector<Wrench> wrench_;
  std::vector<double> pointForces_;   // most x 3 (P + kCouples)
  std::vector<double> nodeForces_;    // most x 3N
  std::vector<double> gram_;          // stride x stride
  std::vector<double> withMotion_;    // stride x kColumns: with the motion
  std::vector<double> withAtoms_;     // 3A x stride
  std::vector<unsigned char> asked_;  // A: whether its products are computed
};

}  // namespace tractiond::solve
