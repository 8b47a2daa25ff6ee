// Round loads, and a sensor with its model of contacts and patches and the dense twin of it.
#pragma once

#include "tests/unit/solve/dense_patches.h"
#include "tests/unit/solve/model_bench.h"

namespace tractiond::solve {

/// A gel that is no half-space, and its model with patches.
class PatchBench : public Bench {
 public:
  explicit PatchBench(const sensor::Sensor& sensor, const ModelOptions& options = everyMode())
      : Bench(sensor, options, blockImage)
      , model_(this->sensor(), factors(), atoms(), options)
      , twin_(sensor.nodes, sensor.layers.front().depth, influence(), strays(), scale_N(), options,
              [this](const sensor::Points& sources) { return halfSpaceImage(this->sensor(), sources); }) {}

  Estimate solve(const VectorXd& displacement, const std::vector<int>& missing = {}) {
    return Bench::solve(model_, displacement, missing);
  }
  DensePatches::Mixed twin(const VectorXd& displacement, const std::vector<int>& missing = {}) const {
    return twin_.solve(displacement, presentOf(missing), kNoise_px);
  }
  const DensePatches& dense() const { return twin_; }
  Model& model() { return model_; }

 private:
  Model model_;
  DensePatches twin_;
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

}  // namespace tractiond::solve
