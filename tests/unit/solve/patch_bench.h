// Round loads, and a sensor with its model of contacts and patches.
#pragma once

#include "tests/unit/solve/model_bench.h"

#include <Eigen/Geometry>

#include <cmath>

namespace tractiond::solve {

/// A gel that is no half-space, and its model with patches.
class PatchBench : public Bench {
 public:
  explicit PatchBench(const sensor::Sensor& sensor, const ModelOptions& options = everyMode())
      : Bench(sensor, options, blockImage)
      , model_(this->sensor(), factors(), atoms(), options) {}

  Estimate solve(const VectorXd& displacement, const std::vector<int>& missing = {}) {
    return Bench::solve(model_, displacement, missing);
  }
  Model& model() { return model_; }

 private:
  Model model_;
};

/// An even pressure on a disc, and a torsion.
inline Load disc(double x_mm, double y_mm, double radius_mm, const Vector3d& force_N, double torsion_Nmm = 0.0) {
  Load load;
  constexpr int kRings = 6;
  double count = 0.0, arms = 0.0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double r = radius_mm * (ring + 0.5) / kRings;
    for (int i = 0; i < 6 * (2 * ring + 1); ++i, count += 1.0) {
      const double angle = 2.0 * 3.14159265358979323846 * i / (6 * (2 * ring + 1));
      load.push_back({x_mm + r * std::cos(angle), y_mm + r * std::sin(angle), force_N});
      arms += r * r;
    }
  }
  for (PointForce& at : load) {
    at.force = at.force / count + torsion_Nmm / arms * Vector3d(y_mm - at.y_mm, at.x_mm - x_mm, 0.0);
  }
  return load;
}

inline Load both(Load a, const Load& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Returns force and moment about the origin [N, N m].
inline VectorXd wrenchOf(const Load& load) {
  VectorXd sum = VectorXd::Zero(6);
  for (const PointForce& at : load) {
    sum.head<3>() += at.force;
    sum.tail<3>() += 1e-3 * Vector3d(at.x_mm, at.y_mm, 0.0).cross(at.force);
  }
  return sum;
}

}  // namespace tractiond::solve
