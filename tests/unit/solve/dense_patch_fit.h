// The dense, slow twin of the fit of round patches (docs/mathematics.md, section 4), without a line of what it
// tests.
#pragma once

#include "tests/unit/solve/dense_model.h"

#include <functional>
#include <vector>

namespace tractiond::solve {

class DensePatchFit : public DenseModel {
 public:
  /// What a half-space does, 2M x 3S [px/N], under unit forces at so many places of its surface.
  using HalfSpace = std::function<Matrix(const sensor::Points&)>;

  struct Patch {
    Eigen::Vector3d place;  ///< x, y, spread
    Eigen::Vector4d load;
  };

  DensePatchFit(const sensor::NodeGrid& nodes, double depth_m, const Matrix& influence, const Matrix& motion,
                double force_N, const ModelOptions& options, const HalfSpace& halfSpace);

  /// Returns the displacements by a unit of each component of force and torsion of a patch, 2M x 4.
  Matrix columns(const Eigen::Vector3d& place) const;

 protected:
  struct Frame {
    Vector d;
    Matrix motion;
    std::vector<int> present;
    double n2;
  };
  /// Two patches, or none.
  using Bar = std::vector<std::size_t>;

  Eigen::Vector2d inGrid(const Eigen::Vector3d& at) const { return (at - points_.col(0)).head<2>() / pitch_; }

  static double lagrange(double at, int number);

  Eigen::Vector3d units() const { return {pitch_, pitch_, pitch_ * pitch_}; }

  /// The points whose pressure is that of their neighbours or more, the highest first.
  std::vector<Eigen::Index> maxima(const Vector& forces, Vector& force, Vector& height) const;

  Patch startAt(const Eigen::Vector3d& at) const;

  /// `bar`: two patches that are the ends of a straight contact, or none.
  Matrix columnsOf(const Frame& frame, const std::vector<Patch>& patches, const Bar& bar) const;

  static Vector loadsOf(const std::vector<Patch>& patches);

  /// By place and spread, 3 for each patch.
  Matrix slopesOf(const Frame& frame, const std::vector<Patch>& patches, const Bar& bar) const;

  double priorOf(const std::vector<Patch>& patches) const;

  /// Least squares with the priors as rows of their own. Sets the loads; returns the minimum.
  double linear(const Frame& frame, std::vector<Patch>& patches, Vector& motion, const Bar& bar) const;

  static Vector scaledSolve(const Matrix& B, const Vector& right);

  struct Fitted {
    std::vector<Patch> patches;
    Vector motion;
    double misfit;
  };

  /// Rows: the picture, the priors of motion and spreads. Unknowns: loads, motion, places [pitches, pitches^2].
  Matrix equations(const Frame& frame, const Fitted& now, Vector& right, const Bar& bar = {}) const;

  Fitted fit(const Frame& frame, const std::vector<Patch>& start, const Bar& bar = {}, double precision = 1) const;

  /// The log evidence by Laplace's approximation. `least`: the patch whose load is the fewest of its deviations.
  double logEvidence(const Frame& frame, const Fitted& now, std::size_t& least) const;

  double logEvidence(const Frame& frame, const Fitted& now) const;

  static double radius(const Patch& patch) { return 2 * std::sqrt(std::max(patch.place[2], 0.0)); }
  static double distance(const Patch& a, const Eigen::Vector3d& b) { return (a.place - b).head<2>().norm(); }

  bool areNarrow(const Fitted& now) const;

  bool areTwoContacts(const Frame& frame, const Fitted& now, std::size_t a, std::size_t b) const;

  /// No patches: none that explain the picture.
  Fitted find(const Frame& frame, const Vector& forces, double enough) const;

  /// Two equal points so far from each other that the variance along and that across differ as the field's do nearby.
  Eigen::Vector3d halfLength(const Patch& patch, const Vector& force) const;

  sensor::NodeGrid nodes_;
  double pitch_;
  int columns_;
  HalfSpace halfSpace_;
  Matrix rest_;
};

}  // namespace tractiond::solve
