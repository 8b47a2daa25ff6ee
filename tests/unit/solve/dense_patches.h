// The dense, slow twin of round patches as the mean of the prior (docs/mathematics.md, section 4), as dense_model.h
// is of the field: every matrix whole, in double precision, without a line of what it tests.
#pragma once

#include "tests/unit/solve/dense_patch_fit.h"

namespace tractiond::solve {

class DensePatches : public DensePatchFit {
 public:
  struct Mixed {
    Vector forces;  ///< of the points
    Eigen::Matrix<double, 6, 1> wrench;
    Eigen::Matrix<double, 6, 6> covariance;
    Matrix pointCovariance;
    double share = 0.0, even = 0.0;  ///< of the patches; of an even contact
    std::vector<Patch> patches;
    std::vector<Matrix> patchCovariance;
  };

  using DensePatchFit::DensePatchFit;

  Mixed solve(const Vector& displacement, const std::vector<int>& present, double noise_px) const;

 private:
  struct Candidate {
    double worth;
    Vector forces;
    Eigen::Matrix<double, 6, 1> wrench;
    Eigen::Matrix<double, 6, 6> covariance;
    Vector change = {};  ///< of all loads, then all places
    Matrix changeCovariance = {};
  };

  /// Shares of the points in a patch.
  Vector spread(const Eigen::Vector3d& place) const;

  /// The same with the place as their centroid, by bisection.
  Vector centred(const Eigen::Vector3d& place) const;

  void addForces(const Patch& patch, const Vector& share, Vector& forces) const;

  /// The even contact of forces of the points.
  /// `fieldDegrees`: degrees of freedom that were used for the forces.
  std::vector<Candidate> even(const Frame& frame, const Vector& forces, double fieldDegrees) const;

  /// P x 2: the footprint, and half of what moving its edge either way changes.
  Matrix footprint(const Vector& forces) const;

  std::vector<Candidate> around(const Frame& frame, const std::vector<Patch>& patches) const;
};

}  // namespace tractiond::solve
