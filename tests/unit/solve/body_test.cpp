// A body of another shape, by its own Green's functions.
#include "daemon/solve/factors_cache.h"
#include "daemon/solve/model_solver.h"
#include "daemon/solve/systematic.h"
#include "sensor/influence_file.h"
#include "tests/support/fingertip.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace tractiond::solve::body_test {
namespace {

using sensor::elastic::displacementMatrix;
using sensor::elastic::Model;

/// The half-space under the sensor's own grids, as an influence file would say it.
sensor::Body flatBody(const sensor::Sensor& sensor) {
  return test::bodyOn(sensor, displacementMatrix(sensor, Model::kHalfSpace));
}

sensor::Sensor withBody(sensor::Sensor sensor, sensor::Body body) {
  EXPECT_TRUE(sensor::setBody(sensor, std::move(body)));
  return sensor;
}

sensor::Sensor plainSensor() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) layer.columns = layer.rows = 14;
  sensor.nodes.columns = sensor.nodes.rows = 12;
  // A body has no such numbers.
  sensor.uncertainty.poissonRatio = sensor.uncertainty.thickness = sensor.uncertainty.layerDepth = 0.0;
  return sensor;
}

SolveOptions onHalfSpace() {
  SolveOptions options;
  options.model = Model::kHalfSpace;
  return options;
}

Factors factorsOf(const sensor::Sensor& sensor) {
  return loadOrComputeFactors(sensor, makeAtoms(sensor), onHalfSpace(), "/dev/null/none").value();
}

/// Returns the factors of the body's atoms on the half-space under the grids of `plain`, without the body's influence.
Factors factorsWithout(const sensor::Sensor& body, const sensor::Sensor& plain) {
  const Atoms atoms = makeAtoms(body);
  const Eigen::MatrixXd displacement =
      displacementMatrix(plain.gel, Model::kHalfSpace, sensor::markerPositions(plain), atoms.points);
  Factors factors = computeFactors(sensor::elastic::toImage(plain, displacement), atoms, motionPrior(plain),
                                   plain.gel.youngsModulus * square(plain.nodes.pitch), onHalfSpace())
                        .value();
  factors.systematicErrors = systematicErrors(plain, onHalfSpace(), factors, atoms, straysOf(plain, onHalfSpace()));
  return factors;
}

TractionField solved(const sensor::Sensor& sensor, const Factors& factors, const Eigen::VectorXd& forces) {
  TractionField field;
  field.resize(sensor.markerCount(), sensor.nodes.count());
  const Atoms atoms = makeAtoms(sensor);
  ModelSolver(factors, atoms, sensor, onHalfSpace())
      .solve(fieldOf(sensor::elastic::toImage(sensor, displacementMatrix(sensor, Model::kHalfSpace)) * forces), field);
  EXPECT_TRUE(field.valid);
  return field;
}

/// Solves a noiseless press of 0.4 N and shear on four nodes in the middle: bodies have no help at the rim.
TractionField pressed(const sensor::Sensor& sensor, const Factors& factors) {
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(3 * sensor.nodes.count());
  for (const int node : {65, 66, 77, 78}) forces.segment<3>(3 * node) << 0.02, -0.01, 0.1;
  return solved(sensor, factors, forces);
}

TEST(Body, FlatHalfSpaceReadsAsTheMechanics) {
  const sensor::Sensor plain = plainSensor(), body = withBody(plain, flatBody(plain));
  const TractionField a = pressed(body, factorsWithout(body, plain)), b = pressed(body, factorsOf(body));
  for (std::size_t i = 0; i < a.force_N.size(); ++i) EXPECT_NEAR(a.force_N[i], b.force_N[i], 1e-7);
  for (std::size_t i = 0; i < 36; ++i) {
    EXPECT_NEAR(a.noise[i], b.noise[i], 1e-12);
    EXPECT_NEAR(a.systematic[i], b.systematic[i], 1e-9);
  }
  const Eigen::Vector3d truth(0.08, -0.04, 0.4);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(b.resultant_N[axis], truth[axis], 3.0 * std::sqrt(b.noise[7 * axis]));
    EXPECT_LT(std::sqrt(b.noise[7 * axis]), 0.05);
  }
  EXPECT_EQ(b.work.patchShare, 0.0);  // its mechanics are known at the nodes alone
  ASSERT_EQ(a.contactCount, 1);
  ASSERT_EQ(b.contactCount, 1);
  EXPECT_NEAR(a.contacts[0].position_m[0], b.contacts[0].position_m[0], 1e-9);
  EXPECT_NEAR(a.contacts[0].area_m2, b.contacts[0].area_m2, 1e-12);
}

TEST(Body, MomentCountsWhereTheNodesAre) {
  const sensor::Sensor plain = smallSensor();
  sensor::Body raised = flatBody(plain);
  raised.nodes.row(2) = 10.0 * raised.nodes.colwise().squaredNorm();
  const sensor::Sensor sensor = withBody(plain, std::move(raised));
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(3 * sensor.nodes.count());
  forces.segment<3>(30) << 0.5, 0.2, 1.0;
  const TractionField field = solved(sensor, factorsOf(sensor), forces);
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  double rounding = 1e-12;  // of the published forces, which are floats
  for (int n = 0; n < sensor.nodes.count(); ++n) {
    const Eigen::Vector3d force = Eigen::Vector3f::Map(field.force_N.data() + 3 * n).cast<double>();
    moment += sensor.body->nodes.col(n).cross(force);
    rounding += 0x1p-24 * sensor.body->nodes.col(n).norm() * force.norm();
  }
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(field.moment_Nm[axis], moment[axis], rounding);
}

TEST(Body, AreaIsThatOfItsNodes) {
  const sensor::Sensor plain = plainSensor();
  sensor::Body uneven = flatBody(plain);
  for (Eigen::Index n = 1; n < uneven.areas.size(); n += 2) uneven.areas[n] *= 3.0;
  const sensor::Sensor sensor = withBody(plain, std::move(uneven));
  const TractionField field = pressed(sensor, factorsOf(sensor));
  ASSERT_EQ(field.contactCount, 1);
  double sum = 0.0, squares = 0.0;
  for (Eigen::Index n = 0; n < sensor.body->areas.size(); ++n) {
    const double force = Eigen::Vector3f::Map(field.force_N.data() + 3 * n).cast<double>().norm();
    sum += force;
    squares += force * force / sensor.body->areas[n];
  }
  EXPECT_NEAR(field.contacts[0].area_m2, sum * sum / squares, 1e-3 * field.contacts[0].area_m2);
}

TEST(Body, YoungsModulusOfTheGelScalesIt) {
  const sensor::Sensor plain = smallSensor();
  sensor::Sensor body = withBody(plain, flatBody(plain));
  body.gel.youngsModulus *= 2.0;
  EXPECT_TRUE(displacementMatrix(body, Model::kBlock).isApprox(0.5 * body.body->influence, 1e-15));
}

TEST(Body, IdIsOfItsContent) {
  const sensor::Sensor plain = smallSensor(), body = withBody(plain, flatBody(plain));
  sensor::Body other = flatBody(plain);
  other.influence(0, 0) *= 1.0 + 1e-15;
  EXPECT_NE(calibrationId(plain, {}), calibrationId(body, {}));
  EXPECT_NE(calibrationId(body, {}), calibrationId(withBody(plain, other), {}));
  EXPECT_EQ(calibrationId(body, {}), calibrationId(withBody(plain, flatBody(plain)), {}));
  sensor::Sensor wider = body, longer = body;
  wider.nodes.pitch *= 1.1;  // of larger areas
  longer.nodes.columns = body.nodes.count();
  longer.nodes.rows = 1;
  EXPECT_NE(calibrationId(body, {}), calibrationId(wider, {}));
  EXPECT_NE(calibrationId(body, {}), calibrationId(longer, {}));
}

}  // namespace
}  // namespace tractiond::solve::body_test
