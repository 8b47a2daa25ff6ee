// The model of contacts against its dense twin (dense_model.h), and what must hold without one.
#include "daemon/solve/model.h"

#include "tests/unit/solve/dense_model.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::solve {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kNoise_px = 0.0165;

/// Takes every mode: the twin leaves none out.
ModelOptions everyMode() {
  ModelOptions options;
  options.noise_px = kNoise_px;
  options.faintest = 0.0;
  return options;
}

MotionPrior strays(const sensor::Sensor& sensor) {
  return {sensor::elastic::pictureMotionMatrix(sensor), Eigen::Vector4d(0.02, 0.02, 1e-4, 1e-4).cwiseAbs2()};
}

/// A point force [N].
struct Force {
  double x_mm, y_mm;
  Eigen::Vector3d force;
};

/// A sensor on a half-space, its model and the twin.
class Bench {
 public:
  explicit Bench(const sensor::Sensor& sensor, const ModelOptions& options = everyMode())
      : sensor_(sensor)
      , options_(options)
      , motion_(strays(sensor))
      , force_N_(sensor.gel.youngsModulus * sensor.nodes.pitch * sensor.nodes.pitch)
      , atoms_(makeAtoms(sensor))
      , influence_(halfSpaceImage(sensor, atoms_.points))
      , factors_(computeFactors(influence_, atoms_, motion_, force_N_, options).value())
      , model_(factors_, atoms_, options)
      , twin_(sensor.nodes, 6e-3, influence_, motion_.modes * motion_.variances.cwiseSqrt().asDiagonal(), force_N_,
              options) {}

  /// Displacements with noise and motion of the picture.
  VectorXd picture(const std::vector<Force>& forces, unsigned seed, double noise_px = kNoise_px) const {
    VectorXd displacement = VectorXd::Zero(influence_.rows());
    for (const Force& at : forces) {
      displacement += halfSpaceImage(sensor_, Eigen::Vector3d(1e-3 * at.x_mm, 1e-3 * at.y_mm, 0.0)) * at.force;
    }
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    for (int k = 0; k < kMotions; ++k) {
      displacement += motion_.modes.col(k) * std::sqrt(motion_.variances[k]) * normal(generator);
    }
    for (double& d : displacement) d += noise_px * normal(generator);
    return displacement.cast<float>().cast<double>();
  }

  Estimate solve(const VectorXd& displacement, const std::vector<int>& missing = {}, double noise_px = kNoise_px) {
    Estimate estimate;
    estimate.force_N.resize(3 * static_cast<std::size_t>(atoms_.pointCount()));
    Eigen::VectorXf there = displacement.cast<float>();
    for (const int coordinate : missing) there[coordinate] = 0.0F;
    model_.solve({there.data(), static_cast<std::size_t>(there.size())}, missing, noise_px, estimate);
    return estimate;
  }

  DenseModel::Result twin(const VectorXd& displacement, const std::vector<int>& missing = {},
                          double noise_px = kNoise_px) const {
    std::vector<int> present;
    for (int i = 0; i < displacement.size(); ++i) {
      if (std::find(missing.begin(), missing.end(), i) == missing.end()) present.push_back(i);
    }
    return twin_.solve(displacement, present, noise_px);
  }

  const Atoms& atoms() const { return atoms_; }
  const Factors& factors() const { return factors_; }
  const DenseModel& twinModel() const { return twin_; }

 private:
  sensor::Sensor sensor_;
  ModelOptions options_;
  MotionPrior motion_;
  double force_N_;
  Atoms atoms_;
  MatrixXd influence_;
  Factors factors_;
  Model model_;
  DenseModel twin_;
};

VectorXd forcesOf(const Estimate& estimate) {
  return VectorXd::Map(estimate.force_N.data(), static_cast<Eigen::Index>(estimate.force_N.size()));
}

Eigen::Matrix<double, 6, 6> covarianceOf(const Estimate& estimate) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 6>>(estimate.covariance.data());
}

double largest(const VectorXd& vector) { return vector.cwiseAbs().maxCoeff(); }

/// Single precision of the streamed matrices is what may differ.
void expectSame(const Estimate& fast, const DenseModel::Result& slow) {
  EXPECT_EQ(fast.rounds, slow.rounds);
  EXPECT_EQ(fast.atoms, static_cast<int>(slow.atoms.size()));
  const double scale = largest(slow.forces);
  std::cout << "forces " << largest(forcesOf(fast) - slow.forces) / scale << " atoms " << fast.atoms << " rounds "
            << fast.rounds << " residual " << fast.squaredResidual_px2 / slow.residual - 1 << " covariance "
            << (covarianceOf(fast) - slow.covariance).norm() / slow.covariance.norm() << "\n";
  EXPECT_LT(largest(forcesOf(fast) - slow.forces), 1e-4 * scale);
}

TEST(Model, PrintsWhatTheTwinSays) {
  ModelOptions options = everyMode();
  if (getenv("ROUGH")) options.roughness = atof(getenv("ROUGH"));
  if (getenv("GATE")) options.gate = atof(getenv("GATE"));
  if (getenv("TURN")) options.turning = atof(getenv("TURN"));
  if (getenv("MOST")) { int m = atoi(getenv("MOST")); options.most = {{{m, m, 2*m}, {2*m,2*m,4*m}}}; }
  Bench bench(smallSensor(), options);
  const Eigen::Vector3d press(0, 0, 1), shear(1, 0, 0), across(0, 1, 0);
  const std::vector<std::vector<Force>> loads = {
      {{1, 2, press}},
      {{-2, 0.5, shear}},
      {{4, 0, across}, {-4, 0, -across}},
      {{-6, -4, 0.5 * press}, {6, 4, press}},
      {{9, 8, press}},
      {},
  };
  unsigned seed = 1;
  for (const auto& forces : loads) {
    const VectorXd displacement = bench.picture(forces, seed++);
    expectSame(bench.solve(displacement), bench.twin(displacement));
  }
}

}  // namespace
}  // namespace tractiond::solve
