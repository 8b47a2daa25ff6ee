// Loads, and a sensor with its model of contacts.
#pragma once

#include "daemon/solve/model.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Geometry>

#include <cmath>
#include <optional>
#include <random>
#include <vector>

namespace tractiond::solve {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kNoise_px = 0.0165;
inline const Vector3d kPress = Vector3d::UnitZ(), kShear = Vector3d::UnitX(), kAcross = Vector3d::UnitY();

/// Takes every mode, as formulae without a limit do.
inline SolveOptions everyMode() {
  SolveOptions options;
  options.noise_px = kNoise_px;
  options.faintest = 0.0;
  return options;
}

/// [N].
struct PointForce {
  double x_mm, y_mm;
  Vector3d force;
};
using Load = std::vector<PointForce>;

/// Returns an even pressure on a square as 7 x 7 point forces.
inline Load square(double x_mm, double y_mm, double half_mm, double force_N) {
  Load load;
  constexpr int kAlong = 7;
  for (int i = 0; i < kAlong * kAlong; ++i) {
    const double u = 2.0 * (i % kAlong) / (kAlong - 1) - 1.0, v = 2.0 * (i / kAlong) / (kAlong - 1) - 1.0;  // NOLINT
    load.push_back({x_mm + u * half_mm, y_mm + v * half_mm, force_N / (kAlong * kAlong) * kPress});
  }
  return load;
}

/// Marker displacements [px/N] for unit forces at points of the surface, 2M x 3S.
using Image = MatrixXd(const sensor::Sensor& sensor, const sensor::Points& sources);

/// Returns those of a half-space plus a smooth part, as a block has one.
inline MatrixXd blockImage(const sensor::Sensor& sensor, const sensor::Points& sources) {
  sensor::Points above = sources;
  above.row(2).array() -= 20e-3;
  return halfSpaceImage(sensor, sources) - 0.5 * halfSpaceImage(sensor, above);
}

/// A sensor and its model.
/// \param image of the sensor's gel
/// \param hasPatches whether the model has patches
class Bench {
 public:
  explicit Bench(const sensor::Sensor& sensor, const SolveOptions& options = everyMode(), Image* image = halfSpaceImage,
                 bool hasPatches = false)
      : sensor_(sensor)
      , image_(image)
      , motion_{sensor::elastic::pictureMotionMatrix(sensor), Eigen::Vector4d(0.02, 0.02, 1e-4, 1e-4).cwiseAbs2()}
      , atoms_(makeAtoms(sensor))
      , influence_(image(sensor, atoms_.points))
      , factors_(computeFactors(influence_, atoms_, motion_, scale_N(), options).value())
      , model_(hasPatches ? Model(sensor_, factors_, atoms_, options) : Model(factors_, atoms_, options)) {}

  /// Returns displacements with the picture's motion and noise, 2M [px].
  VectorXd picture(const Load& load, unsigned seed, double noise_px = kNoise_px) const {
    VectorXd displacement = VectorXd::Zero(influence_.rows());
    for (const PointForce& at : load) {
      displacement += image_(sensor_, Vector3d(1e-3 * at.x_mm, 1e-3 * at.y_mm, 0.0)) * at.force;
    }
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    for (int k = 0; k < kMotions; ++k) displacement += strays().col(k) * normal(generator);
    for (double& d : displacement) d += noise_px * normal(generator);
    return displacement.cast<float>().cast<double>();
  }

  Estimate solve(const VectorXd& displacement, const std::vector<int>& missing = {}, double noise_px = kNoise_px) {
    Estimate estimate;
    estimate.force_N.resize(3 * atoms_.pointCount());
    model_.solve(solved_.emplace(factors_, displacement, missing, noise_px), estimate);
    return estimate;
  }

  std::vector<int> presentOf(const std::vector<int>& missing) const {
    std::vector<int> present;
    for (int i = 0; i < influence_.rows(); ++i) {
      if (!std::binary_search(missing.begin(), missing.end(), i)) present.push_back(i);
    }
    return present;
  }

  double scale_N() const { return sensor_.gel.youngsModulus * sensor_.nodes.pitch * sensor_.nodes.pitch; }
  MatrixXd strays() const { return motion_.modes * motion_.variances.cwiseSqrt().asDiagonal(); }
  /// Returns H of all atoms, 2M x 3A.
  MatrixXd atomInfluence() const {
    const MatrixXd shape = atoms_.shape;
    MatrixXd H = MatrixXd::Zero(influence_.rows(), 3 * shape.cols());
    for (Eigen::Index a = 0; a < shape.cols(); ++a) {
      for (Eigen::Index p = 0; p < shape.rows(); ++p) {
        H.middleCols<3>(3 * a) += shape(p, a) * influence_.middleCols<3>(3 * p);
      }
    }
    return H;
  }
  const sensor::Sensor& sensor() const { return sensor_; }
  const MatrixXd& influence() const { return influence_; }
  const Atoms& atoms() const { return atoms_; }
  const Factors& factors() const { return factors_; }
  Model& model() { return model_; }

 private:
  sensor::Sensor sensor_;
  Image* image_;
  MotionPrior motion_;
  Atoms atoms_;
  MatrixXd influence_;
  Factors factors_;
  Model model_;
  std::optional<Picture> solved_;
};

inline VectorXd forcesOf(const Estimate& estimate) {
  return VectorXd::Map(estimate.force_N.data(), static_cast<Eigen::Index>(estimate.force_N.size()));
}

inline VectorXd wrenchOf(const Estimate& estimate) {
  return VectorXd::Map(estimate.wrench.data(), 6);
}

inline MatrixXd covarianceOf(const Estimate& estimate) {
  return MatrixXd::Map(estimate.covariance.data(), 6, 6);
}

/// Returns the largest difference of two wrenches, in standard deviations of the first one.
inline double differenceInDeviations(const Estimate& a, const VectorXd& wrench) {
  return ((wrenchOf(a) - wrench).array() / covarianceOf(a).diagonal().array().sqrt()).abs().maxCoeff();
}

/// A gel that is no half-space, and its model with patches.
struct PatchBench : Bench {
  PatchBench()
      : Bench(smallSensor(), everyMode(), blockImage, true) {}
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

/// Returns the coordinates, ascending, of every fifth marker of the upper layer and of a hole in both.
inline std::vector<int> missingOf(const sensor::Sensor& sensor) {
  std::vector<int> missing;
  const sensor::Points markers = sensor::markerPositions(sensor);
  for (int m = 0; m < markers.cols(); ++m) {
    const bool hole = (markers.col(m).head<2>() - Eigen::Vector2d(4e-3, 3e-3)).norm() < 3e-3;
    if (hole || (m < markers.cols() / 2 && m % 5 == 0)) missing.insert(missing.end(), {2 * m, 2 * m + 1});
  }
  return missing;
}

}  // namespace tractiond::solve
