// Presses on the paper's sensor, a half-space, and a fixture that solves their pictures by the model.
#pragma once

#include "daemon/solve/model_solver.h"
#include "sensor/elastic/influence.h"
#include "sensor/elastic/loads.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace tractiond::solve {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

inline constexpr double kGramForce = 9.80665e-3;  // [N]
inline constexpr double kNoise_px = 0.018;

inline const sensor::Sensor& paper() {
  static const sensor::Sensor sensor;
  return sensor;
}

inline MotionPrior paperMotion() {
  return {sensor::elastic::pictureMotionMatrix(paper()), Eigen::Vector4d(4e-4, 4e-4, 1e-8, 1e-8)};
}

inline const MatrixXd& influence() {
  static const MatrixXd matrix = halfSpaceImage(paper(), sensor::nodePositions(paper().nodes));
  return matrix;
}

inline const Atoms& paperAtoms() {
  static const Atoms atoms = makeAtoms(paper());
  return atoms;
}

inline Factors makePaperFactors() {
  return computeFactors(halfSpaceImage(paper(), paperAtoms().points), paperAtoms(), paperMotion(),
                        paper().gel.youngsModulus * square(paper().nodes.pitch), SolveOptions{})
      .value();
}

inline const Factors& paperFactors() {
  static const Factors factors = makePaperFactors();
  return factors;
}

inline ModelSolver& paperSolver() {
  static ModelSolver solver(paperFactors(), paperAtoms(), paper());
  return solver;
}

/// A patch and what it does to the picture, 2M x 3 [px/N].
struct Press {
  Vector2d at;
  MatrixXd image;

  std::array<double, 6> wrench(const Vector3d& f) const {
    return {f.x(), f.y(), f.z(), at.y() * f.z(), -at.x() * f.z(), at.x() * f.y() - at.y() * f.x()};
  }
};

inline Press press(const Vector2d& at, const sensor::elastic::PatchQuadrature& patch) {
  const MatrixXd points = halfSpaceImage(paper(), patch.points);
  Press result{at, MatrixXd::Zero(points.rows(), 3)};
  for (Eigen::Index i = 0; i < patch.points.cols(); ++i) {
    result.image += patch.forces(2, i) * points.middleCols<3>(3 * i);
  }
  return result;
}

/// Returns the press of a ball: 1 N along each axis in turn.
/// \param radius of the contact [m]
inline Press press(const Vector2d& at, double radius) {
  return press(at, sensor::elastic::hertz(at, radius, Vector3d::UnitZ()));
}

class PressTest : public testing::Test {
 protected:
  PressTest() { field_.resize(paper().markerCount(), paper().nodes.count()); }

  VectorXd noise() {
    return VectorXd::NullaryExpr(influence().rows(), [this] { return kNoise_px * normal_(random_); });
  }

  static MarkerField seen(const VectorXd& displacement) {
    MarkerField field = fieldOf(displacement);
    std::fill(field.variance_px2.begin(), field.variance_px2.end(), static_cast<float>(kNoise_px * kNoise_px));
    return field;
  }

  const TractionField& solve(const MarkerField& markers) {
    paperSolver().solve(markers, field_);
    EXPECT_TRUE(field_.valid);
    return field_;
  }
  const TractionField& solve(const VectorXd& displacement) { return solve(seen(displacement)); }

  Vector3d resultant() const { return Vector3d::Map(field_.resultant_N.data()); }

  std::mt19937 random_{1};
  std::normal_distribution<double> normal_;
  TractionField field_;
};

}  // namespace tractiond::solve
