// The dense, slow twin of round patches as the mean of the prior (docs/decisions/0020-one-inverse.md), as dense_model.h
// is of the field: every matrix whole, in double precision, without a line of what it tests.
#pragma once

#include "tests/unit/solve/dense_model.h"

#include <functional>
#include <vector>

namespace tractiond::solve {

class DensePatches : public DenseModel {
 public:
  /// What a half-space does, 2M x 3S [px/N], under unit forces at so many places of its surface.
  using HalfSpace = std::function<Matrix(const sensor::Points&)>;

  struct Patch {
    Eigen::Vector3d place;  ///< x, y, spread
    Eigen::Vector4d load;
  };

  struct Mixed {
    Vector forces;  ///< of the points
    Eigen::Matrix<double, 6, 1> wrench;
    Eigen::Matrix<double, 6, 6> covariance;
    Matrix pointCovariance;
    double share = 0.0;  ///< of the patches
    std::vector<Patch> patches;
    std::vector<Matrix> patchCovariance;
  };

  DensePatches(const sensor::NodeGrid& nodes, double depth_m, const Matrix& influence, const Matrix& motion,
               double force_N, const ModelOptions& options, const HalfSpace& halfSpace);

  /// 2M x 4 by force and torsion of a patch.
  Matrix columns(const Eigen::Vector3d& place) const;

  Mixed solve(const Vector& displacement, const std::vector<int>& present, double noise_px) const;

 private:
  struct Frame {
    Vector d;
    Matrix motion;
    std::vector<int> present;
    double n2;
  };
  struct Candidate {
    double worth;
    Vector forces;
    Eigen::Matrix<double, 6, 1> wrench;
    Eigen::Matrix<double, 6, 6> covariance;
    Vector change;  ///< of all loads, then all places
    Matrix changeCovariance;
  };

  Eigen::Vector2d inGrid(const Eigen::Vector3d& at) const { return (at - points_.col(0)).head<2>() / pitch_; }

  static double lagrange(double at, int number);

  Eigen::Vector3d units() const { return {pitch_, pitch_, pitch_ * pitch_}; }

  std::vector<Patch> peaks(const Vector& forces) const;

  Matrix columnsOf(const Frame& frame, const std::vector<Patch>& patches) const;

  /// By place and spread, 3 for each patch.
  Matrix slopesOf(const Frame& frame, const std::vector<Patch>& patches) const;

  double priorOf(const std::vector<Patch>& patches) const;

  /// Least squares with the priors as rows of their own. Sets the loads; returns the minimum.
  double linear(const Frame& frame, std::vector<Patch>& patches, Vector& motion) const;

  static Vector scaledSolve(const Matrix& B, const Vector& right);

  struct Fitted {
    std::vector<Patch> patches;
    Vector motion;
    double misfit;
  };

  /// Rows: the picture, the priors of motion and spreads. Unknowns: loads, motion, places [pitches, pitches^2].
  Matrix equations(const Frame& frame, const Fitted& now, Vector& right) const;

  Fitted fit(const Frame& frame, const std::vector<Patch>& start) const;

  /// The log evidence by Laplace's approximation. `least`: the patch whose load is the fewest of its deviations.
  double logEvidence(const Frame& frame, const Fitted& now, std::size_t& least) const;

  Fitted likely(const Frame& frame, const std::vector<Patch>& start) const;

  /// Shares of the points in a patch.
  Vector spread(const Eigen::Vector3d& place) const;

  /// The same with the place as their centroid, by bisection.
  Vector centred(const Eigen::Vector3d& place) const;

  static void addForces(const Patch& patch, const Vector& share, Vector& forces);

  std::vector<Candidate> around(const Frame& frame, const std::vector<Patch>& patches) const;

  sensor::NodeGrid nodes_;
  double pitch_;
  int columns_;
  HalfSpace halfSpace_;
  Matrix rest_;
};

}  // namespace tractiond::solve
