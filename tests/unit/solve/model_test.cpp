// The model of contacts against its dense twin (dense_model.h), and what must hold without one.
#include "sensor/influence_file.h"
#include "tests/unit/solve/model_bench.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>
#include <set>

namespace tractiond::solve {
namespace {

using Outcome = Estimate::Outcome;

/// But for what the single precision of the streamed matrices does.
void expectSame(const Estimate& fast, const DenseModel::Result& slow) {
  ASSERT_EQ(fast.outcome, Outcome::kFound);
  EXPECT_EQ(fast.rounds, slow.rounds);
  EXPECT_EQ(fast.atoms, static_cast<int>(slow.atoms.size()));
  EXPECT_LT((forcesOf(fast) - slow.forces).cwiseAbs().maxCoeff(), 2e-5 * slow.forces.cwiseAbs().maxCoeff());
  EXPECT_LT(differenceInDeviations(fast, slow.wrench), 1e-3);
  EXPECT_LT((covarianceOf(fast) - slow.covariance).norm(), 1e-5 * slow.covariance.norm());
  EXPECT_NEAR(fast.squaredResidual_px2, slow.residual, 1e-5 * slow.residual);
}

sensor::Sensor mediumSensor() {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) layer.columns = layer.rows = 12;
  sensor.nodes.columns = sensor.nodes.rows = 12;
  return sensor;
}

TEST(Atoms, OfThePapersGel) {
  const sensor::Sensor sensor;
  const Atoms atoms = makeAtoms(sensor);
  EXPECT_EQ(atoms.pointCount(), 28 * 28);
  EXPECT_EQ(atoms.count(), 28 * 28 + 13 * 13 + 7 * 7 + 3 * 3 + 1 + 3 * 4 * 3);
  ASSERT_EQ(atoms.levels.size(), 6U);
  EXPECT_EQ(atoms.levels[0].end, atoms.pointCount());
  EXPECT_EQ(atoms.levels[5].end, atoms.count());
  EXPECT_DOUBLE_EQ(atoms.levels[3].reach_m, 3e-3);
  EXPECT_DOUBLE_EQ(atoms.levels[4].reach_m, 9e-3);
  EXPECT_FALSE(atoms.levels[2].ambiguous);
  EXPECT_TRUE(atoms.levels[3].ambiguous);
  EXPECT_DOUBLE_EQ(atoms.levels[2].spacing_m, 12e-3);
  EXPECT_DOUBLE_EQ(atoms.depth_m, 6e-3);
  const sensor::Points nodes = sensor::nodePositions(sensor);
  int beyond = 0;
  for (int p = 0; p < atoms.pointCount(); ++p) {
    const auto squares = (nodes.colwise() - atoms.points.col(p)).colwise().squaredNorm();
    EXPECT_NEAR((atoms.points.col(atoms.nearest[p]) - atoms.points.col(p)).squaredNorm(), squares.minCoeff(), 1e-12);
    if (atoms.nodes[p] < 0) {
      ++beyond;
    } else {
      EXPECT_EQ(atoms.nearest[p], p);
      EXPECT_LT((atoms.points.col(p) - nodes.col(atoms.nodes[p])).norm(), 1e-12);
    }
  }
  EXPECT_EQ(beyond, 28 * 28 - 24 * 24);
  const MatrixXd shape = atoms.shape;
  EXPECT_LT((shape.colwise().sum().array() - 1.0).abs().maxCoeff(), 1e-12);
  for (int p = 0; p < atoms.pointCount(); ++p) {
    if (atoms.nodes[p] >= 0) continue;
    EXPECT_EQ(shape.row(p).segment(atoms.pointCount(), atoms.levels[4].end - atoms.pointCount()).sum(), 0.0);
  }
}

TEST(Atoms, LinesLieAlongTheSides) {
  sensor::Sensor oblong = smallSensor();
  oblong.nodes = {.columns = 20, .rows = 5, .pitch = 2.5e-3, .centre = {1e-3, -2e-3}};
  const Atoms atoms = makeAtoms(oblong);
  const Level& lines = atoms.levels.back();
  EXPECT_EQ(lines.end - lines.first, 3 * 2 * (3 + 1));
  for (int a = lines.first; a < lines.end; ++a) {
    std::set<int> columns, rows;
    for (Eigen::SparseMatrix<double>::InnerIterator it(atoms.shape, a); it; ++it) {
      columns.insert(static_cast<int>(it.row()) % atoms.columns);
      rows.insert(static_cast<int>(it.row()) / atoms.columns);
    }
    const bool alongX = rows.size() == 1;
    ASSERT_TRUE(alongX || columns.size() == 1);
    const int across = alongX ? *rows.begin() : *columns.begin(), last = (alongX ? atoms.rows : atoms.columns) - 1;
    EXPECT_LE(std::min(across, last - across), 2);
    const std::set<int>& along = alongX ? columns : rows;
    EXPECT_GE(*along.begin(), 2);  // on the rings, too, no longer than the nodes' side
    EXPECT_LE(*along.rbegin(), (alongX ? atoms.columns : atoms.rows) - 3);
    const Eigen::Index axis = alongX ? 1 : 0;
    const Eigen::Index point = alongX ? across * atoms.columns : across;
    EXPECT_NEAR(atoms.places(axis, a), atoms.points(axis, point), 1e-12);
  }
  for (const Level& level : atoms.levels) {
    for (int a = level.first; a < level.end; ++a) EXPECT_NEAR(Eigen::VectorXd(atoms.shape.col(a)).sum(), 1.0, 1e-12);
  }
}

TEST(Atoms, RingsNeedRoomInTheGel) {
  sensor::Sensor sensor;
  sensor.gel.size.x() = 84e-3;
  EXPECT_EQ(makeAtoms(sensor).pointCount(), 28 * 28);
  sensor.gel.size.x() = 78e-3;
  EXPECT_EQ(makeAtoms(sensor).pointCount(), 26 * 26);
  sensor.gel.size.x() = 77e-3;
  const Atoms atoms = makeAtoms(sensor);
  EXPECT_EQ(atoms.pointCount(), 24 * 24);
  EXPECT_EQ(*std::min_element(atoms.nodes.begin(), atoms.nodes.end()), 0);
}

TEST(Model, AgreesWithTheDenseTwin) {
  const std::vector<std::pair<const char*, Load>> loads = {
      {"press", {{1, 2, kPress}}},
      {"shear", {{-2, 0.5, kShear}}},
      {"torsion", {{4, 0, kAcross}, {-4, 0, -kAcross}}},
      {"two contacts", {{-6, -4, 0.5 * kPress}, {6, 4, kPress}}},
      {"on the ring", {{11, 8, kPress + 0.3 * kShear}}},
      {"weak", {{0, 0, 0.05 * kPress}}},
      {"broad", square(0, 0, 6, 2)},
  };
  Bench bench(smallSensor());
  unsigned seed = 1;
  for (const auto& [name, load] : loads) {
    SCOPED_TRACE(name);
    const VectorXd displacement = bench.picture(load, seed++);
    expectSame(bench.solve(displacement), bench.twin(displacement));
  }
}

TEST(Model, SearchesAgainWhereTheTwinDoes) {
  Bench bench(smallSensor(), fewAtoms());
  int secondSearches = 0;
  for (const Load& load : {square(0, 0, 9, 4), Load{{-6, -4, 0.5 * kPress}, {6, 4, kPress}}, Load{{0, 0, 0.3 * kPress}},
                           Load{{9, -8, kPress}, {-7, 7, 0.05 * kPress}}}) {
    const VectorXd displacement = bench.picture(load, 12);  // no atom is just evident: it would make more of rounding
    const Estimate estimate = bench.solve(displacement);
    expectSame(estimate, bench.twin(displacement));
    secondSearches += estimate.rounds == 6 ? 1 : 0;
  }
  EXPECT_GE(secondSearches, 2);
  EXPECT_LE(secondSearches, 3);
}

TEST(Model, AgreesOnOtherGels) {
  sensor::Sensor soft = smallSensor();
  soft.gel.youngsModulus = 0.03e6;
  soft.gel.poissonRatio = 0.3;
  sensor::Sensor oblong = smallSensor();
  oblong.nodes = {.columns = 9, .rows = 4, .pitch = 2.5e-3, .centre = {1e-3, -2e-3}};
  oblong.layers[0].depth = 4e-3;
  for (const sensor::Sensor& sensor : {soft, oblong}) {
    Bench bench(sensor);
    const VectorXd displacement =
        bench.picture({{2, 0, 0.6 * bench.scale_N() * kPress}, {-5, -3, 0.2 * bench.scale_N() * kShear}}, 3);
    expectSame(bench.solve(displacement), bench.twin(displacement));
  }
}

TEST(Model, ForcesGrowWithTheStiffness) {
  sensor::Sensor soft = smallSensor(), stiff = soft;
  stiff.gel.youngsModulus *= 10.0;
  Bench a(soft), b(stiff);
  const VectorXd displacement = a.picture({{1, 2, kPress}, {-6, 0, 0.1 * kShear}}, 5);
  const Estimate one = a.solve(displacement), ten = b.solve(displacement);
  EXPECT_EQ(one.atoms, ten.atoms);
  EXPECT_LT((10.0 * forcesOf(one) - forcesOf(ten)).cwiseAbs().maxCoeff(), 1e-4 * forcesOf(ten).cwiseAbs().maxCoeff());
  EXPECT_LT((100.0 * covarianceOf(one) - covarianceOf(ten)).norm(), 1e-4 * covarianceOf(ten).norm());
}

/// On so small a gel atoms look alike, and noise passes for a force more often.
TEST(Model, FindsNothingInNoiseWhereTheTwinDoesNot) {
  Bench bench(smallSensor());
  int nothing = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const VectorXd displacement = bench.picture({}, seed);
    const Estimate estimate = bench.solve(displacement);
    const DenseModel::Result twin = bench.twin(displacement);
    EXPECT_EQ(estimate.atoms, static_cast<int>(twin.atoms.size()));
    if (estimate.outcome != Outcome::kNothing) continue;
    ++nothing;
    EXPECT_TRUE(forcesOf(estimate).isZero(0.0));
    EXPECT_TRUE(wrenchOf(estimate).isZero(0.0));
    EXPECT_TRUE(covarianceOf(estimate).isZero(0.0));
    EXPECT_NEAR(estimate.squaredResidual_px2, twin.residual, 1e-5 * twin.residual);
    for (int k = 0; k < kMotions; ++k) EXPECT_NEAR(estimate.motion[k], twin.motion[k], 1e-4);
  }
  EXPECT_GE(nothing, 15);
}

TEST(Model, FindsWhatIsDetectedAlsoWhereNoAtomIsEvident) {
  ModelOptions options = everyMode();
  options.surety = 1e4;
  Bench sure(smallSensor(), options);
  const VectorXd displacement = sure.picture(square(0, 0, 6, 2), 7);
  const Estimate estimate = sure.solve(displacement);
  EXPECT_EQ(estimate.outcome, Outcome::kFound);
  expectSame(estimate, sure.twin(displacement));
}

TEST(Model, LeavingFaintModesOutDoesNotShow) {
  ModelOptions options = everyMode();
  options.faintest = ModelOptions().faintest;
  Bench every(mediumSensor()), strong(mediumSensor(), options);
  EXPECT_LT(strong.factors().rank(), every.factors().rank());
  for (const Load& load : {Load{{1, 2, kPress}}, Load{{-14, 9, 0.05 * kPress}}, square(3, 0, 9, 3)}) {
    const VectorXd displacement = every.picture(load, 7);
    EXPECT_LT(differenceInDeviations(every.solve(displacement), wrenchOf(strong.solve(displacement))), 0.2);
  }
}

TEST(Model, FollowsTheFramesNoise) {
  ModelOptions loud = everyMode();
  loud.noise_px = 3.0 * kNoise_px;
  Bench calibrated(smallSensor()), noisy(smallSensor(), loud);
  const VectorXd displacement = noisy.picture({{1, 2, kPress}}, 9, loud.noise_px);
  const Estimate estimate = calibrated.solve(displacement, {}, loud.noise_px);
  const Estimate expected = noisy.solve(displacement, {}, loud.noise_px);
  EXPECT_LT(differenceInDeviations(estimate, wrenchOf(expected)), 0.3);
  EXPECT_NEAR(covarianceOf(estimate)(2, 2), covarianceOf(expected)(2, 2), 0.1 * covarianceOf(expected)(2, 2));
}

TEST(Model, TakesOutMissingMarkers) {
  Bench bench(smallSensor());
  const std::vector<int> missing = missingOf(smallSensor());
  unsigned seed = 20;
  for (const Load& load :
       {Load{{1, 2, kPress}}, Load{{4, 3, kPress}}, Load{{-6, -4, 0.5 * kShear}, {6, 4, kPress}}, square(0, 0, 6, 2)}) {
    const VectorXd displacement = bench.picture(load, seed++);
    const Estimate estimate = bench.solve(displacement, missing);
    const DenseModel::Result twin = bench.twin(displacement, missing);
    EXPECT_EQ(estimate.rounds, twin.rounds);
    EXPECT_LT(differenceInDeviations(estimate, twin.wrench), 0.25);  // the start alone is not exact
    EXPECT_NEAR(covarianceOf(estimate)(2, 2), twin.covariance(2, 2), 0.05 * twin.covariance(2, 2));
    EXPECT_GT(differenceInDeviations(estimate, wrenchOf(bench.solve(displacement))), 0.4);
  }
}

TEST(Model, KnowsCovariancesOfWhatItFoundLast) {
  Bench bench(smallSensor());
  const Eigen::Index forces = 3 * bench.atoms().pointCount();
  using Weights = Eigen::Matrix<double, Eigen::Dynamic, kColumns, Eigen::RowMajor>;
  Weights weights = Weights::Zero(forces, kColumns);
  for (Eigen::Index i = 0; i < forces; ++i) {
    const Vector3d unit = Vector3d::Unit(i % 3), at = bench.atoms().points.col(i / 3);
    weights.row(i).head<6>() << unit.transpose(), at.cross(unit).transpose();
  }
  MatrixXd all(kColumns, kColumns), covariance(6, 6);
  std::vector<double> deviations(3 * static_cast<std::size_t>(smallSensor().nodes.count()));
  const auto ask = [&] {
    bench.model().mixture().covariance({weights.data(), static_cast<std::size_t>(weights.size())},
                                       everyPoint(bench.atoms().pointCount()),
                                       {all.data(), static_cast<std::size_t>(all.size())});
    covariance = all.topLeftCorner<6, 6>();
    bench.model().mixture().nodeDeviations_N(deviations);
  };

  const Estimate estimate = bench.solve(bench.picture(square(2, 0, 6, 3), 2));
  ASSERT_EQ(estimate.outcome, Outcome::kFound);
  ask();
  EXPECT_LT((covariance - covarianceOf(estimate)).norm(), 1e-9 * covariance.norm());
  const auto largest = std::max_element(deviations.begin(), deviations.end());
  const auto component = static_cast<int>(largest - deviations.begin());
  weights.setZero();
  for (int p = 0; p < bench.atoms().pointCount(); ++p) {
    if (bench.atoms().nodeOf(p) == component / 3) weights(3 * p + component % 3, 0) = 1.0;
  }
  ask();
  const double variance = covariance(0, 0);
  EXPECT_NEAR(*largest, std::sqrt(variance), 1e-9 * *largest);

  ASSERT_EQ(bench.solve(VectorXd::Zero(bench.factors().coordinateCount())).outcome, Outcome::kNothing);
  ask();
  EXPECT_TRUE(covariance.isZero(0.0));
  EXPECT_EQ(*std::max_element(deviations.begin(), deviations.end()), 0.0);
}

TEST(Model, FailsPlainlyWithoutNumbers) {
  Bench bench(smallSensor());
  VectorXd displacement = bench.picture({{1, 2, kPress}}, 1);
  displacement[17] = std::numeric_limits<double>::quiet_NaN();
  const Estimate estimate = bench.solve(displacement);
  EXPECT_EQ(estimate.outcome, Outcome::kFailed);
  EXPECT_TRUE(forcesOf(estimate).isZero(0.0));
  EXPECT_EQ(bench.solve(bench.picture({{1, 2, kPress}}, 1)).outcome, Outcome::kFound);
}

TEST(Model, ReadsABodyByItsNodesAlone) {
  sensor::Sensor sensor = smallSensor();
  const sensor::Points nodes = sensor::nodePositions(sensor);
  ASSERT_TRUE(sensor::setBody(
      sensor, {.file = "flat.npz",
               .youngsModulus = sensor.gel.youngsModulus,
               .influence = sensor::elastic::displacementMatrix(sensor, sensor::elastic::Model::kHalfSpace),
               .nodes = nodes,
               .normals = sensor::nodeNormals(sensor),
               .areas = sensor::nodeAreas(sensor),
               .markers = sensor::markerPositions(sensor)}));
  const Atoms atoms = makeAtoms(sensor);
  EXPECT_EQ(atoms.count(), sensor.nodes.count());
  EXPECT_NEAR(atoms.depth_m, 6e-3, 0.5e-3);
  ModelOptions options;
  options.noise_px = kNoise_px;
  const Factors factors = computeFactors(sensor, atoms, options).value();
  Model model(sensor, factors, atoms, options);
  Eigen::VectorXf displacement =
      (halfSpaceImage(sensor, Vector3d(0.0, 1.5e-3, 0.0)) * Vector3d(0.1, 0.0, 1.0)).cast<float>();
  std::mt19937_64 generator(4);
  std::normal_distribution<float> normal(0.0F, static_cast<float>(kNoise_px));
  for (float& d : displacement) d += normal(generator);
  Estimate estimate;
  estimate.force_N.resize(3 * static_cast<std::size_t>(atoms.pointCount()));
  model.solve({displacement.data(), static_cast<std::size_t>(displacement.size())}, {}, kNoise_px, estimate);
  ASSERT_EQ(estimate.outcome, Outcome::kFound);
  EXPECT_EQ(estimate.patchCount, 0);  // its mechanics are known at the nodes alone
  Eigen::Matrix<double, 6, 1> wrench;
  wrench << 0.1, 0.0, 1.0, 1.5e-3, 0.0, -0.15e-3;
  EXPECT_LT(differenceInDeviations(estimate, wrench), 3.0);
  EXPECT_LT(std::sqrt(estimate.covariance[14]), 0.03);
}

}  // namespace
}  // namespace tractiond::solve
