// What another camera or another block than the gel file's misreads: predicted by the errors, and measured by solving.
#include "daemon/solve/inverse_cache.h"
#include "daemon/solve/solver.h"
#include "daemon/solve/systematic.h"
#include "sensor/elastic/influence.h"
#include "sensor/elastic/loads.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <random>

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
  sensor.camera.aspect = 1.035;  // scales that differ are as systematic as any
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
  for (Eigen::Index i = 0; i < at.cols(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d force = Eigen::Vector3d::Unit(axis);
      wrenches.col(3 * i + axis) << force, at.col(i).cross(force);
    }
  return wrenches;
}

/// What a sensor's picture shows of unit forces at these, 2M x 27 [px/N].
Eigen::MatrixXd seen(const sensor::Sensor& sensor) {
  return sensor::elastic::toImage(sensor, sensor::elastic::displacementMatrix(sensor.gel, Model::kBlock,
                                                                              sensor::markerPositions(sensor), places(),
                                                                              {.degree = 6, .breaks = {}}));
}

Vector6 reading(Solver& solver, const Eigen::VectorXd& image, float variance_px2 = 1e-5F) {
  MarkerField markers = fieldOf(image);
  std::ranges::fill(markers.variance_px2, variance_px2);
  TractionField field;
  field.resize(thin().markerCount(), thin().nodes.count());
  solver.solve(markers, field);
  Vector6 wrench;
  wrench << Eigen::Vector3d::Map(field.resultant_N.data()), Eigen::Vector3d::Map(field.moment_Nm.data());
  return wrench;
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

/// Presses and shears each of the nine places, and adds up what is misread of a wrench that they share.
/// \param readings the wrenches that are read from pictures of unit forces, 6 x 27 \param share by which the prediction
/// may miss; of a press on another thickness
void expectPredicted(const std::function<Eigen::MatrixXd(const Eigen::MatrixXd& image)>& readings,
                     const std::vector<double>& errors, double share, double shareOfThickness) {
  const Eigen::MatrixXd shares = wrenches(places()).completeOrthogonalDecomposition().pseudoInverse();  // 27 x 6
  const Eigen::MatrixXd straight = readings(seen(thin()));
  for (const auto& [number, image] : seenByOthers()) {
    const Eigen::MatrixXd measured = (readings(image) - straight) * shares;
    const Matrix6 predicted = error(errors, number);
    for (const int axis : {0, 2}) {
      const Eigen::Vector3d force = measured.col(axis).head<3>(), expected = predicted.col(axis).head<3>();
      const double allowed = number == kThickness && axis == 2 ? shareOfThickness : share;
      EXPECT_LT((force - expected).norm(), std::max(1e-4, allowed * expected.norm()))
          << number << ", axis " << axis << ": " << force.transpose() << " instead of " << expected.transpose();
    }
  }
}

void expectPredicted(bool contactAware, const std::vector<double>& errors, double share, double shareOfThickness) {
  SolveOptions options;
  options.contactAware = contactAware;
  Solver solver(thinInverse(), thin(), options);
  const auto readings = [&](const Eigen::MatrixXd& image) {
    Eigen::MatrixXd read(6, image.cols());
    for (Eigen::Index i = 0; i < image.cols(); ++i) read.col(i) = reading(solver, kForce_N * image.col(i)) / kForce_N;
    return read;
  };
  expectPredicted(readings, errors, share, shareOfThickness);
}

const SystematicErrors& thinErrors() {
  static const SystematicErrors errors = systematicErrors(thin(), SolveOptions{}, thinInverse());
  return errors;
}

/// Covariance of a contact's wrench by depths that scatter alone.
Matrix6 byScatter(const SystematicErrors& errors, const std::array<double, 6>& wrench, const Eigen::Vector3d& at) {
  sensor::Uncertainty none;
  none.youngsModulus = none.model = 0.0;
  SystematicErrors scatter;
  scatter.contactScatter = errors.contactScatter;
  return Matrix6::Map(systematicCovariance(wrench, at, none, thin().nodes.pitch, scatter, 0.0).data());
}

TEST(Systematic, AContactIsMisreadAsPredicted) {
  ASSERT_EQ(thinErrors().contact.size(), 36U * kCount);
  // The solver chooses its nodes by what it sees, the prediction those around a node; a press reaches furthest, and
  // there the thickness shows most.
  expectPredicted(true, thinErrors().contact, 0.1, 0.3);
}

TEST(Systematic, SoIsTheWholeFace) {
  ASSERT_EQ(thinErrors().wholeFace.size(), 36U * kCount);
  expectPredicted(false, thinErrors().wholeFace, 0.06, 0.01);  // but for the step of the derivatives, the same sum
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

TEST(Systematic, TheModelOfContactsMisreadsASmallContactAsTheNodesAroundIt) {
  sensor::Sensor sensor = smallSensor();
  sensor.uncertainty.markerDepth = 0.1e-3;
  SolveOptions options;
  options.model = Model::kHalfSpace;
  const SystematicErrors nodes = loadOrCompute(sensor, options, "/dev/null/none")->systematicErrors;
  const SystematicErrors model =
      loadOrComputeFactors(sensor, makeAtoms(sensor), options, "/dev/null/none")->systematicErrors;
  ASSERT_EQ(model.contact.size(), nodes.contact.size());
  ASSERT_EQ(model.wholeFace.size(), nodes.wholeFace.size());
  for (std::size_t k = 0; k < nodes.contact.size() / 36; ++k) {
    const Matrix6 expected = error(nodes.contact, static_cast<int>(k));
    EXPECT_LT((error(model.contact, static_cast<int>(k)) - expected).norm(), 1e-3 * expected.norm() + 1e-9) << k;
  }
  const std::array<double, 6> wrench = {0.3, 0.0, 1.0, 0.0, 0.0, 0.0};
  const Matrix6 expected = byScatter(nodes, wrench, {0.01, 0.0, 0.0});
  EXPECT_GT(expected(2, 2), 0.0);
  EXPECT_LT((byScatter(model, wrench, {0.01, 0.0, 0.0}) - expected).norm(), 1e-3 * expected.norm());
}

/// Reads by least squares, with forces of shapeForce_N expected of all atoms, and the motion of the picture.
TEST(Systematic, TheModelOfContactsMisreadsTheWholeFaceAsAllAtomsDo) {
  const SolveOptions options;
  const Atoms atoms = makeAtoms(thin());
  const auto factors = computeFactors(thin(), atoms, modelOptions(options)).value();
  const Eigen::MatrixXd ofPoints = sensor::elastic::toImage(
      thin(),
      sensor::elastic::displacementMatrix(thin().gel, Model::kBlock, sensor::markerPositions(thin()), atoms.points));
  const Eigen::MatrixXd shape = atoms.shape, unit = wrenches(atoms.points);
  const MotionPrior motion = motionPrior(thin());
  const Eigen::Index forces = 3 * shape.cols();
  Eigen::MatrixXd seenOf = Eigen::MatrixXd::Zero(ofPoints.rows(), forces + kMotions);
  Eigen::MatrixXd wrenchOf = Eigen::MatrixXd::Zero(6, seenOf.cols());
  for (Eigen::Index a = 0; a < shape.cols(); ++a) {
    for (Eigen::Index p = 0; p < shape.rows(); ++p) {
      if (shape(p, a) == 0.0) continue;
      seenOf.middleCols<3>(3 * a) += options.shapeForce_N * shape(p, a) * ofPoints.middleCols<3>(3 * p);
      wrenchOf.middleCols<3>(3 * a) += options.shapeForce_N * shape(p, a) * unit.middleCols<3>(3 * p);
    }
  }
  seenOf.rightCols<kMotions>() = motion.modes * motion.variances.cwiseSqrt().asDiagonal();
  Eigen::MatrixXd normal = seenOf.transpose() * seenOf;
  normal.diagonal().array() += options.noise_px * options.noise_px;
  const Eigen::MatrixXd reading = wrenchOf * normal.llt().solve(seenOf.transpose());
  // But for the step of the derivatives, the same sum.
  expectPredicted([&](const Eigen::MatrixXd& image) { return Eigen::MatrixXd(reading * image); },
                  systematicErrors(thin(), options, factors, atoms).wholeFace, 0.06, 0.01);
}

TEST(Systematic, ScatteredDepthsMisreadAContactAsPredicted) {
  constexpr int kGels = 12;
  constexpr double kScatter_m = 0.1e-3;
  sensor::Sensor made = thin();
  made.uncertainty.markerDepth = kScatter_m;
  const SolveOptions options;
  const SystematicErrors errors = systematicErrors(made, options, thinInverse());
  const auto variance_px2 = static_cast<float>(options.noise_px * options.noise_px);
  Solver solver(thinInverse(), thin(), options);
  for (sensor::MarkerLayer& layer : made.layers) layer.depth += kScatter_m;
  const sensor::Points at = places();
  const Eigen::MatrixXd straight = seen(thin()), byDepth = seen(made) - straight, units = wrenches(at);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  for (const int axis : {0, 2}) {
    Vector6 measured = Vector6::Zero(), predicted = Vector6::Zero();  // sums of squares
    for (int gel = 0; gel < kGels; ++gel) {
      Eigen::VectorXd deviations(straight.rows());  // of each marker's depth
      for (Eigen::Index i = 0; i < deviations.size(); i += 2) deviations.segment<2>(i).setConstant(normal(generator));
      for (Eigen::Index column = axis; column < straight.cols(); column += 3) {
        const Eigen::VectorXd image = straight.col(column) + deviations.cwiseProduct(byDepth.col(column));
        const Vector6 misread = reading(solver, kForce_N * image, variance_px2) -
                                reading(solver, kForce_N * straight.col(column), variance_px2);
        measured += misread.cwiseAbs2();
        std::array<double, 6> wrench{};
        Vector6::Map(wrench.data()) = kForce_N * units.col(column);
        predicted += byScatter(errors, wrench, at.col(column / 3)).diagonal();
      }
    }
    // 108 draws tell a deviation to a tenth. The solver chooses its nodes by what it sees.
    for (const int component : {axis, 2, 3, 4}) {
      EXPECT_NEAR(std::sqrt(measured[component] / predicted[component]), 1.0, 0.25) << axis << ", " << component;
    }
  }
}

TEST(Systematic, StiffnessScalesTheWholeWrench) {
  sensor::Uncertainty uncertainty;
  uncertainty.model = 0.0;
  uncertainty.youngsModulus = 0.02;
  const std::array<double, 6> wrench = {1.0, -2.0, 3.0, 0.01, 0.02, -0.03};
  const WrenchCovariance covariance = systematicCovariance(wrench, {0.01, 0.02, 0.0}, uncertainty, 3e-3, {}, 0.0);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) EXPECT_NEAR(covariance[6 * i + j], 4e-4 * wrench[i] * wrench[j], 1e-12);
  }
}

}  // namespace
}  // namespace tractiond::solve::systematic_test
