// What another camera or another block than the gel file's misreads: predicted by the errors, and measured by solving.
#include "daemon/solve/model_solver.h"
#include "daemon/solve/systematic.h"
#include "daemon/solve/wrench.h"
#include "sensor/elastic/influence.h"
#include "sensor/elastic/loads.h"
#include "tests/support/fingertip.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

namespace tractiond::solve::systematic_test {
namespace {

using sensor::elastic::Model;

constexpr double kForce_N = 1.62;  // E pitch^2, which the errors are computed for

enum Number { kPositionZ = 2, kRoll = 5, kFocal, kPoisson, kThickness, kBlue, kRed, kCount };

/// A thin block: its thickness matters.
sensor::Sensor thin() {
  sensor::Sensor sensor;
  sensor.gel.size.z() = 15e-3;
  sensor.camera.position.z() = 132e-3;
  sensor.camera.aspect = 1.035;  // scales that differ are as systematic as any
  return sensor;
}

const Atoms& thinAtoms() {
  static const Atoms atoms = makeAtoms(thin());
  return atoms;
}

const Factors& thinFactors() {
  static const Factors factors = [] {
    Factors made = computeFactors(thin(), thinAtoms(), SolveOptions{}).value();
    made.systematicErrors = systematicErrors(thin(), {}, made, thinAtoms(), straysOf(thin(), {}));
    return made;
  }();
  return factors;
}

SystematicErrors errorsOf(const sensor::Sensor& sensor) {
  return systematicErrors(sensor, SolveOptions{}, thinFactors(), thinAtoms(), straysOf(sensor, SolveOptions{}));
}

Matrix6 error(const std::vector<double>& errors, int number) {
  return Matrix6::Map(errors.data() + 36 * number);
}

/// Nine nodes across the face, at which errors are taken.
sensor::Points places() {
  const sensor::NodeGrid& grid = thin().nodes;
  std::vector<int> nodes;
  for (const int row : {grid.rows / 4, grid.rows / 2, grid.rows * 3 / 4})
    for (const int column : {grid.columns / 4, grid.columns / 2, grid.columns * 3 / 4})
      nodes.push_back(row * grid.columns + column);
  return sensor::nodePositions(thin())(Eigen::all, nodes);
}

/// 6 x 27: the wrench of unit forces at these.
Eigen::MatrixXd wrenches(const sensor::Points& at) {
  Eigen::MatrixXd wrenches(6, 3 * at.cols());
  for (Eigen::Index i = 0; i < at.cols(); ++i) wrenches.middleCols<3>(3 * i) = unitWrenches(at.col(i));
  return wrenches;
}

/// What a sensor's picture shows of unit forces at these, 2M x 27 [px/N].
Eigen::MatrixXd seen(const sensor::Sensor& sensor) {
  return sensor::elastic::toImage(sensor, sensor::elastic::displacementMatrix(
                                              sensor.gel, Model::kBlock, sensor::markerPositions(sensor), places(), 6));
}

Wrench reading(FieldSolver& solver, const Eigen::VectorXd& image) {
  const auto variance_px2 = static_cast<float>(SolveOptions{}.noise_px * SolveOptions{}.noise_px);
  MarkerField markers = fieldOf(image);
  std::ranges::fill(markers.variance_px2, variance_px2);
  TractionField field;
  field.resize(thin().markerCount(), thin().nodes.count());
  solver.solve(markers, field);
  return wrenchOf(field);
}

/// Of sensors that are each one deviation off, by number.
const std::map<int, Eigen::MatrixXd>& seenByOthers() {
  static const std::map<int, Eigen::MatrixXd> seenByOthers = [] {
    sensor::Sensor others[kCount];
    std::ranges::fill(others, thin());
    const sensor::Uncertainty by = thin().uncertainty;
    others[kPositionZ].camera.position.z() += by.position.z();
    others[kPositionZ].camera.focal_px *= 1.0 + by.focal * by.focalDistance;
    others[kRoll].camera.rotation.z() += by.rotation.z();
    others[kFocal].camera.focal_px *= 1.0 + by.focal * std::sqrt(1.0 - by.focalDistance * by.focalDistance);
    others[kPoisson].gel.poissonRatio += by.poissonRatio;
    others[kThickness].gel.size.z() += by.thickness;
    others[kBlue].layers[0].depth += by.layerDepth;
    others[kRed].layers[1].depth += by.layerDepth;
    std::map<int, Eigen::MatrixXd> result;
    for (const int number : {kPositionZ, kRoll, kFocal, kPoisson, kThickness, kBlue, kRed})
      result[number] = seen(others[number]);
    return result;
  }();
  return seenByOthers;
}

/// Returns the wrenches, 6 x 27, that are read for unit forces at the nine places, which the pictures show.
Eigen::MatrixXd byModel(const Eigen::MatrixXd& image) {
  static ModelSolver solver(thinFactors(), thinAtoms(), thin());
  Eigen::MatrixXd read(6, image.cols());
  for (Eigen::Index i = 0; i < image.cols(); ++i) read.col(i) = reading(solver, kForce_N * image.col(i)) / kForce_N;
  return read;
}

const SystematicErrors& thinErrors() {
  return thinFactors().systematicErrors;
}

/// Presses and shears each of the nine places, and adds up what is misread of a wrench that they share.
TEST(Systematic, AContactIsMisreadAsPredicted) {
  ASSERT_EQ(thinErrors().contact.size(), 36U * kCount);
  const Eigen::MatrixXd shares = wrenches(places()).completeOrthogonalDecomposition().pseudoInverse();  // 27 x 6
  const Eigen::MatrixXd straight = byModel(seen(thin()));
  for (const auto& [number, image] : seenByOthers()) {
    const Eigen::MatrixXd measured = (byModel(image) - straight) * shares;
    const Matrix6 predicted = error(thinErrors().contact, number);
    for (const int axis : {0, 2}) {
      const Eigen::Vector3d force = measured.col(axis).head<3>(), expected = predicted.col(axis).head<3>();
      // The solver fits a patch, whose reading the prediction linearises; a press reaches furthest, and there the
      // thickness shows most.
      const double allowed = number == kThickness && axis == 2 ? 0.3 : 0.1;
      EXPECT_LT((force - expected).norm(), std::max(1e-4, allowed * expected.norm()))
          << number << ", axis " << axis << ": " << force.transpose() << " instead of " << expected.transpose();
    }
  }
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
  const SystematicErrors after = errorsOf(sensor);
  for (int number = 0; number < kCount; ++number) {
    const Matrix6 contact = error(thinErrors().contact, number), whole = error(thinErrors().wholeFace, number);
    const Matrix6 taken = contact(2, 2) * Matrix6::Identity();
    EXPECT_TRUE(error(after.contact, number).isApprox(contact - taken, 1e-12));
    EXPECT_TRUE(error(after.wholeFace, number).isApprox(whole - taken, 1e-12));
  }
  sensor.calibration->geometry = "2026-11-20T08:20:00Z";  // another pose than the one the weights were read with
  EXPECT_FALSE(isWeighed(sensor));
}

/// A body that is a block with this gel.
sensor::Body bodyOf(const sensor::Sensor& sensor) {
  return test::bodyOn(sensor, sensor::elastic::displacementMatrix(sensor, Model::kBlock));
}

TEST(Systematic, ABodyHasTheCamerasErrorsAlone) {
  sensor::Sensor sensor = thin();
  sensor.uncertainty.poissonRatio = sensor.uncertainty.thickness = sensor.uncertainty.layerDepth = 0.0;
  const SystematicErrors exact = errorsOf(sensor);
  sensor::Body stiffer = bodyOf(sensor);
  stiffer.youngsModulus *= 2.0;
  stiffer.influence /= 2.0;
  sensor.body = std::make_shared<sensor::Body>(stiffer);
  const SystematicErrors errors = errorsOf(sensor);
  ASSERT_EQ(errors.contact.size(), 36U * kPoisson);
  for (int number = 0; number < kPoisson; ++number) {
    const Matrix6 block = error(exact.contact, number);
    EXPECT_LT((error(errors.contact, number) - block).norm(), 0.02 * block.norm() + 1e-6);
  }
}

TEST(Systematic, ABodysOwnErrorsAreTakenForWhatTheyDo) {
  sensor::Sensor sensor = thin(), thicker = sensor;
  thicker.gel.size.z() += sensor.uncertainty.thickness;
  sensor::Body body = bodyOf(sensor);
  body.errors = {bodyOf(thicker).influence - body.influence};
  sensor.body = std::make_shared<sensor::Body>(std::move(body));
  const SystematicErrors errors = errorsOf(sensor);
  ASSERT_EQ(errors.contact.size(), 36U * (kPoisson + 1));
  const Matrix6 block = error(thinErrors().contact, kThickness);
  EXPECT_LT((error(errors.contact, kPoisson) - block).norm(), 0.05 * block.norm());
}

TEST(Systematic, ErrorsAreTakenAcrossAListOfNodesAsAcrossAGrid) {
  const sensor::Sensor sensor = thin();
  const sensor::Points grid = sensor::nodePositions(sensor);
  const auto ofGrid = nineOf(grid, sensor.nodes.columns, sensor.nodes.rows);
  std::vector<int> order(grid.cols());
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(1));
  const sensor::Points list = grid(Eigen::all, order);
  const auto ofList = nineOf(list, sensor.nodes.count(), 1);
  for (std::size_t i = 0; i < ofList.size(); ++i) {
    EXPECT_LT((list.col(ofList[i]) - grid.col(ofGrid[i])).norm(), 1.5 * sensor.nodes.pitch) << i;
  }
}

TEST(Systematic, StiffnessScalesTheWholeWrench) {
  sensor::Sensor sensor = thin();
  sensor.uncertainty.model = 0.0;
  sensor.uncertainty.youngsModulus = 0.02;
  const Factors exact;
  std::vector<double> forces(3 * sensor.nodes.count());
  forces[2] = 1.0;
  const Wrench wrench(1.0, -2.0, 3.0, 0.01, 0.02, -0.03);
  const WrenchCovariance covariance = SystematicPart(exact, sensor).covariance(wrench, forces);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(covariance[6 * i + j], 4e-4 * wrench[i] * wrench[j], 1e-12);
  }
}

}  // namespace
}  // namespace tractiond::solve::systematic_test
