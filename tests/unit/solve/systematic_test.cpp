// What another camera or another block than the gel file's misreads: predicted by the errors, and measured by solving.
#include "daemon/solve/solver.h"
#include "daemon/solve/systematic.h"
#include "sensor/elastic/influence.h"
#include "sensor/elastic/loads.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

namespace tractiond::solve::systematic_test {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using sensor::elastic::Model;

constexpr double kForce_N = 2.0;

enum Number { kPositionZ = 2, kRoll = 5, kFocal, kPoisson, kThickness, kBlue, kRed, kCount };

/// A thin block: its thickness matters.
sensor::Sensor thin() {
  sensor::Sensor sensor;
  sensor.gel.size.z() = 15e-3;
  sensor.camera.position.z() = 132e-3;
  return sensor;
}

const Inverse& thinInverse() {
  static const Inverse inverse = computeInverse(sensor::elastic::influenceMatrix(thin(), Model::kBlock),
                                                still(2 * thin().markerCount()), SolveOptions{})
                                     .value();
  return inverse;
}

Matrix6 error(const std::vector<double>& errors, int number) {
  return Matrix6::Map(errors.data() + 36 * number);
}

constexpr double kX_m = 4e-3, kY_m = -5e-3;  // of the load

/// What a sensor's picture shows of unit forces on a ball's contact, 2M x 3 [px/N].
Eigen::MatrixXd seen(const sensor::Sensor& sensor) {
  const auto load = sensor::elastic::hertz({kX_m, kY_m}, 2.5e-3, Eigen::Vector3d::UnitZ());
  const Eigen::MatrixXd image = sensor::elastic::toImage(
      sensor, sensor::elastic::displacementMatrix(sensor.gel, Model::kBlock, sensor::markerPositions(sensor),
                                                  load.points, {.degree = 6, .breaks = {}}));
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(image.rows(), 3);
  for (Eigen::Index i = 0; i < load.points.cols(); ++i) sum += load.forces(2, i) * image.middleCols<3>(3 * i);
  return sum;
}

Vector6 reading(Solver& solver, const Eigen::VectorXd& image) {
  MarkerField markers = fieldOf(image);
  std::ranges::fill(markers.variance_px2, 1e-5F);
  TractionField field;
  field.resize(thin().markerCount(), thin().nodes.count());
  solver.solve(markers, field);
  Vector6 wrench;
  wrench << Eigen::Vector3d::Map(field.resultant_N.data()), Eigen::Vector3d::Map(field.moment_Nm.data());
  return wrench;
}

/// Those that take most of it, of all strays.
void expectPredicted(bool contactAware, const std::vector<double>& errors, double share) {
  sensor::Sensor others[kCount];
  std::ranges::fill(others, thin());
  const sensor::Uncertainty by = thin().uncertainty;
  others[kPositionZ].camera.position.z() += by.position.z();
  others[kRoll].camera.rotation.z() += by.rotation.z();
  others[kFocal].camera.focal_px *= 1.0 + by.focal;
  others[kPoisson].gel.poissonRatio += by.poissonRatio;
  others[kThickness].gel.size.z() += by.thickness;
  others[kBlue].layers[0].depth += by.layerDepth;
  others[kRed].layers[1].depth += by.layerDepth;
  SolveOptions options;
  options.contactAware = contactAware;
  Solver solver(thinInverse(), thin(), options);
  const Eigen::MatrixXd straight = seen(thin());
  for (const int number : {kPositionZ, kRoll, kFocal, kPoisson, kThickness, kBlue, kRed}) {
    const Eigen::MatrixXd strayed = seen(others[number]);
    for (const int axis : {0, 2}) {
      const Eigen::Vector3d force = kForce_N * Eigen::Vector3d::Unit(axis);
      Vector6 wrench;
      wrench << force, Eigen::Vector3d(kX_m, kY_m, 0.0).cross(force);
      const Vector6 measured =
          reading(solver, kForce_N * strayed.col(axis)) - reading(solver, kForce_N * straight.col(axis));
      const Vector6 predicted = error(errors, number) * wrench;
      // The errors are means over the face, and one place has its own.
      EXPECT_LT((measured - predicted).head<3>().norm(), std::max(2e-3 * kForce_N, share * predicted.head<3>().norm()))
          << number << ", axis " << axis << ": " << measured.head<3>().transpose() << " instead of "
          << predicted.head<3>().transpose();
    }
  }
}

const SystematicErrors& thinErrors() {
  static const SystematicErrors errors = systematicErrors(thin(), SolveOptions{}, thinInverse());
  return errors;
}

TEST(Systematic, AContactIsMisreadAsPredicted) {
  ASSERT_EQ(thinErrors().contact.size(), 36U * kCount);
  expectPredicted(true, thinErrors().contact, 0.35);
}

TEST(Systematic, SoIsTheWholeFace) {
  ASSERT_EQ(thinErrors().wholeFace.size(), 36U * kCount);
  expectPredicted(false, thinErrors().wholeFace, 0.7);  // places differ more
}

TEST(Systematic, PressAndShearAreMisreadApart) {
  // Poisson's ratio changes how a gel that cannot give way flows aside: a press by 1.3 % for 0.005, a shear hardly.
  EXPECT_NEAR(error(thinErrors().contact, kPoisson)(2, 2), 0.013, 0.003);
  EXPECT_NEAR(error(thinErrors().contact, kPoisson)(0, 0), 0.0013, 0.001);
}

TEST(Systematic, WeightsTakeUpWhatMisreadsAPress) {
  sensor::Sensor sensor = thin();
  sensor.calibration.emplace();
  sensor.calibration->geometry = "2026-11-20T08:00:00Z";
  sensor.calibration->stiffness = "2026-11-20T08:10:00Z";
  ASSERT_TRUE(isWeighed(sensor));
  const SystematicErrors after = systematicErrors(sensor, SolveOptions{}, thinInverse());
  for (int number = 0; number < kCount; ++number) {
    const Matrix6 contact = error(thinErrors().contact, number), whole = error(thinErrors().wholeFace, number);
    const Matrix6 taken = contact(2, 2) * Matrix6::Identity();
    EXPECT_TRUE(error(after.contact, number).isApprox(contact - taken, 1e-12));
    EXPECT_TRUE(error(after.wholeFace, number).isApprox(whole - taken, 1e-12));
  }
  sensor.calibration->geometry = "2026-11-20T08:20:00Z";  // another pose than the one the weights were read with
  EXPECT_FALSE(isWeighed(sensor));
}

TEST(Systematic, ABodyHasTheCamerasErrorsAlone) {
  sensor::Sensor sensor = thin();
  auto body = std::make_shared<sensor::Body>();
  body->youngsModulus = 2.0 * sensor.gel.youngsModulus;
  body->markers = sensor::markerPositions(sensor);
  body->nodes = sensor::nodePositions(sensor);
  body->influence = 0.5 * sensor::elastic::displacementMatrix(sensor, Model::kBlock);
  sensor.body = body;
  const SystematicErrors errors = systematicErrors(sensor, SolveOptions{}, thinInverse());
  ASSERT_EQ(errors.contact.size(), 36U * kPoisson);
  for (int number = 0; number < kPoisson; ++number) {
    const Matrix6 block = error(thinErrors().contact, number);
    EXPECT_LT((error(errors.contact, number) - block).norm(), 0.02 * block.norm() + 1e-6);
  }
}

TEST(Systematic, StiffnessScalesTheWholeWrench) {
  sensor::Uncertainty uncertainty;
  uncertainty.model = 0.0;
  uncertainty.youngsModulus = 0.02;
  const std::array<double, 6> wrench = {1.0, -2.0, 3.0, 0.01, 0.02, -0.03};
  const WrenchCovariance covariance = systematicCovariance(wrench, uncertainty, 3e-3, {});
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(covariance[6 * i + j], 4e-4 * wrench[i] * wrench[j], 1e-12);
  }
}

}  // namespace
}  // namespace tractiond::solve::systematic_test
