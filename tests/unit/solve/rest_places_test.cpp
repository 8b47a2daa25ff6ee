// What a rest picture says of the markers' places, and the model at these places, against the block's mechanics there.
#include "daemon/solve/make_solver.h"
#include "daemon/solve/model.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/solve/sensors.h"

#include <gtest/gtest.h>

#include <random>

namespace tractiond::solve::rest_places_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kNoise_px = 0.0165;

sensor::Sensor thinSensor() {
  sensor::Sensor sensor = smallSensor();
  sensor.gel.size.z() = 15e-3;
  return sensor;
}

/// As layers that are made by hand, in their planes, no farther than a plausible distance.
sensor::Points handMade(const sensor::Sensor& sensor) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal(0.0, 0.3e-3);
  sensor::Points scatter = sensor::Points::Zero(3, sensor.markerCount());
  for (auto column : scatter.colwise()) {
    do {
      column.head<2>() << normal(generator), normal(generator);
    } while (column.norm() > 0.8e-3);
  }
  return scatter;
}

sensor::Sensor handMadeSensor() {
  sensor::Sensor sensor = thinSensor();
  sensor.scatter = handMade(sensor);
  return sensor;
}

/// Pixels of the markers at rest, u and v one after another.
VectorXd restPicture(const sensor::Sensor& sensor) {
  const sensor::Points markers = sensor::markerPositions(sensor);
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  VectorXd picture(2 * markers.cols());
  for (Index m = 0; m < markers.cols(); ++m) picture.segment<2>(2 * m) = project(markers.col(m));
  return picture;
}

RestPlaces placesIn(const VectorXd& picture, const std::vector<std::uint8_t>& present) {
  const std::vector<float> place(picture.begin(), picture.end());
  return restPlaces(thinSensor(), place, present);
}

std::vector<std::uint8_t> allPresent() {
  return std::vector<std::uint8_t>(static_cast<std::size_t>(thinSensor().markerCount()), 1);
}

MatrixXd blockInfluence(const sensor::Sensor& sensor, const sensor::Points& points) {
  return sensor::elastic::toImage(sensor,
                                  sensor::elastic::displacementMatrix(sensor.gel, sensor::elastic::Model::kBlock,
                                                                      sensor::markerPositions(sensor), points));
}

/// The motion of the whole picture that explains a difference of rest pictures best.
Eigen::Vector4d motionIn(const VectorXd& difference) {
  const MatrixXd byMotion = sensor::elastic::pictureMotionMatrix(thinSensor());
  const Eigen::Matrix4d normal = byMotion.transpose() * byMotion;
  return normal.ldlt().solve(byMotion.transpose() * difference);
}

/// Expects the scatter of `made`, but for what the motion of the whole picture in it is.
void expectScatter(const RestPlaces& places, const sensor::Sensor& made) {
  sensor::Sensor found = thinSensor();
  found.scatter = places.scatter;
  const VectorXd picture = restPicture(found), difference = restPicture(made) - picture;
  const MatrixXd byMotion = sensor::elastic::pictureMotionMatrix(thinSensor());
  constexpr double kWithin_px = 0.02;  // 3 um; the scatter is 0.3 mm
  EXPECT_LT((difference - byMotion * motionIn(difference)).cwiseAbs().maxCoeff(), kWithin_px);
  const VectorXd beside = picture - restPicture(thinSensor());
  EXPECT_LT((byMotion * motionIn(beside)).cwiseAbs().maxCoeff(), kWithin_px) << "motion is no scatter";
}

TEST(RestPlaces, AreThoseOfTheMarkersAndMotionOfThePictureIsNone) {
  const sensor::Sensor made = handMadeSensor();
  const Eigen::Vector4d motion(9.0, -4.0, 2e-3, 3e-3);  // a shift of 1.5 mm
  const VectorXd moved = sensor::elastic::pictureMotionMatrix(thinSensor()) * motion;
  for (const double times : {0.0, 1.0}) {
    const RestPlaces places = placesIn(restPicture(made) + times * moved, allPresent());
    EXPECT_EQ(places.measured, made.markerCount());
    EXPECT_EQ(places.missing, 0);
    EXPECT_EQ(places.implausible, 0);
    EXPECT_NEAR(places.rms_m, 0.3e-3, 0.03e-3);
    EXPECT_TRUE(places.scatter.row(2).isZero(0.0));
    expectScatter(places, made);
  }
}

TEST(RestPlaces, MissingAndImplausibleMarkersKeepTheirPlacesInTheGrid) {
  const sensor::Sensor made = handMadeSensor();
  VectorXd picture = restPicture(made);
  picture.segment<2>(2 * 11) += Vector2d(25.0, -10.0);
  picture.segment<2>(2 * 20).setConstant(-1e6);
  std::vector<std::uint8_t> present = allPresent();
  present[20] = present[30] = 0;
  const RestPlaces places = placesIn(picture, present);
  EXPECT_EQ(places.missing, 2);
  EXPECT_EQ(places.implausible, 1);
  EXPECT_EQ(places.measured, made.markerCount() - 3);
  present[11] = 0;
  const RestPlaces without = placesIn(restPicture(made), present);
  for (const Index marker : {11, 20, 30}) EXPECT_TRUE(places.scatter.col(marker).isZero(0.0));
  EXPECT_LT((places.scatter - without.scatter).norm(), 1e-9) << "they do not tell of the others' motion";
}

/// With the computed factors of the gel as drawn, and the points of its atoms.
class AtPlaces : public testing::Test {
 protected:
  static const Factors& drawn() {
    static const Factors factors = computeFactors(thinSensor(), atoms(), options()).value();
    return factors;
  }
  static const Atoms& atoms() {
    static const Atoms kAtoms = makeAtoms(thinSensor());
    return kAtoms;
  }
  static const MatrixXd& ofHandMade() {
    static const MatrixXd influence = blockInfluence(handMadeSensor(), atoms().points);
    return influence;
  }
  static SolveOptions options() {
    SolveOptions options;
    options.noise_px = kNoise_px;
    return options;
  }
};

TEST_F(AtPlaces, InfluenceIsThatOfTheBlockThere) {
  const sensor::Sensor made = handMadeSensor();
  const MatrixXd& there = ofHandMade();
  const double largest = there.cwiseAbs().maxCoeff();
  const double error = (influenceAtPlaces(made, atoms(), drawn()) - there).cwiseAbs().maxCoeff();
  EXPECT_LT(error, 1e-3 * largest);
  const Eigen::VectorXf asDrawn =
      Eigen::VectorXf::Map(drawn().influence.row(3 * atoms().pointCount() / 2), there.rows());
  EXPECT_GT((asDrawn.cast<double>() - there.col(3 * atoms().pointCount() / 2)).cwiseAbs().maxCoeff(), 0.01 * largest);
}

/// The modes are sought among those of the gel as drawn: what that costs shows in the faintest ones alone.
TEST_F(AtPlaces, ForcesAreThoseOfTheFullComputation) {
  const sensor::Sensor made = handMadeSensor();
  const auto factors = [&](const Factors* nearly) {
    return computeFactors(influenceAtPlaces(made, atoms(), drawn()), atoms(), motionPrior(made), drawn().force_N,
                          options(), nearly)
        .value();
  };
  const Factors near = factors(&drawn()), full = factors(nullptr);
  ASSERT_LE(near.rank(), full.rank());
  EXPECT_GT(near.rank(), full.rank() * 95 / 100);
  for (int k = 0; k < near.rank() / 2; ++k) {
    EXPECT_NEAR(near.singularValues[k], full.singularValues[k], 2e-3 * full.singularValues[k]) << k;
  }
  Model byNear(made, near, atoms(), options()), byFull(made, full, atoms(), options());
  Estimate a, b;
  a.force_N.resize(3 * atoms().pointCount());
  b.force_N = a.force_N;
  std::mt19937_64 generator(2);
  std::normal_distribution<double> noise(0.0, kNoise_px);
  for (const Vector3d& force : {Vector3d(0, 0, 4), Vector3d(0.5, 0, 1), Vector3d(0, -0.2, 0.3)}) {
    VectorXd moved = ofHandMade().middleCols<3>(3 * (atoms().pointCount() / 2 + 2)) * force;
    for (double& each : moved) each += noise(generator);
    const Picture picture(full, moved, {}, kNoise_px);
    byNear.solve(picture, a);
    byFull.solve(picture, b);
    ASSERT_EQ(b.outcome, Estimate::Outcome::kFound);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR(a.wrench[i], b.wrench[i], 0.05 * std::sqrt(b.covariance[7 * i])) << i;
    }
  }
}

/// From the zero to the field, as the daemon has it.
TEST(SolverAtRest, ReadsAPressOnAHandMadeGel) {
  const test::TemporaryFolder directory;
  const sensor::Sensor sensor = thinSensor(), made = handMadeSensor();
  SolveOptions options;
  options.noise_px = kNoise_px;
  ASSERT_TRUE(followsRest(sensor));
  const auto drawn = makeSolver(sensor, options, directory.path()).value().solver;
  const VectorXd rest = restPicture(made);
  const std::vector<float> place(rest.begin(), rest.end());
  const auto atRest =
      makeSolverAtRest(sensor, options, directory.path(), place, allPresent(), drawn->detectionLimit_N()).value();
  EXPECT_EQ(atRest.solver->detectionLimit_N(), drawn->detectionLimit_N());

  VectorXd moved = blockInfluence(made, Vector3d(0.7e-3, 0.4e-3, 0.0)) * Vector3d(0, 0, 3);
  std::mt19937_64 generator(3);
  std::normal_distribution<double> noise(0.0, kNoise_px);
  for (double& each : moved) each += noise(generator);
  TractionField field;
  field.resize(sensor.markerCount(), sensor.nodes.count());
  const auto error = [&](FieldSolver& solver) {
    solver.solve(fieldOf(moved), field);
    EXPECT_TRUE(field.valid);
    return (Vector3d::Map(field.resultant_N.data()) - Vector3d(0, 0, 3)).norm();
  };
  const double asDrawn = error(*drawn), asMade = error(*atRest.solver);
  EXPECT_LT(asMade, 0.03);
  EXPECT_GT(asDrawn, 3.0 * asMade);
}

TEST(SolverAtRest, IsOfABlockAlone) {
  EXPECT_TRUE(followsRest(thinSensor()));
  sensor::Sensor body = thinSensor();
  body.body = std::make_shared<sensor::Body>();
  EXPECT_FALSE(followsRest(body));
}

}  // namespace
}  // namespace tractiond::solve::rest_places_test
