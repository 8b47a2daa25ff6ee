// The fast solver against its slow, obvious twin: dense least squares in double precision, the rows of missing markers
// left out.
#include "daemon/solve/solver.h"
#include "tests/unit/solve/random_loads.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tractiond::solve::solver_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Eigen::VectorXf;

struct Solution {
  VectorXd forces;
  double residual_px = 0.0;
};

class Twin {
 public:
  Twin(MatrixXd influence, const SolveOptions& options)
      : influence_(std::move(influence)) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> gram(influence_.transpose() * influence_);
    const double largest = std::sqrt(gram.eigenvalues().maxCoeff());
    lambda_ = options.regularisation * largest;
    const double smallest = std::max(options.truncation * lambda_, 1e-6 * largest);
    basis_ = gram.eigenvectors().rightCols((gram.eigenvalues().array() > smallest * smallest).count());
  }

  /// The forces in the span of the kept singular vectors that minimise |d - H f|^2 + lambda^2 |f|^2 over valid rows.
  Solution solve(const MarkerField& field) const {
    std::vector<Eigen::Index> rows;
    for (std::size_t i = 0; i < 2 * field.valid.size(); ++i) {
      if (field.valid[i / 2] != 0) rows.push_back(static_cast<Eigen::Index>(i));
    }
    const MatrixXd a = influence_(rows, Eigen::all) * basis_;
    const VectorXd all = VectorXf::Map(field.displacement_px.data(), influence_.rows()).cast<double>();
    const VectorXd d = all(rows);
    MatrixXd stacked(a.rows() + a.cols(), a.cols());
    stacked << a, lambda_ * MatrixXd::Identity(a.cols(), a.cols());
    VectorXd right = VectorXd::Zero(stacked.rows());
    right.head(d.size()) = d;
    const VectorXd amplitudes = stacked.householderQr().solve(right);
    return {basis_ * amplitudes, std::sqrt((d - a * amplitudes).squaredNorm() / static_cast<double>(d.size()))};
  }

 private:
  MatrixXd influence_, basis_;
  double lambda_ = 0.0;
};

/// A hole in the picture is the hard case: what is inside is hardly seen from outside.
void loseNearest(MarkerField& field, const sensor::Sensor& sensor, const Eigen::Vector2d& centre, int count) {
  const sensor::Points positions = sensor::markerPositions(sensor.layers);
  std::vector<int> order(field.valid.size());
  std::iota(order.begin(), order.end(), 0);
  const auto distance = [&](int marker) { return (positions.col(marker).head<2>() - centre).norm(); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return distance(a) < distance(b); });
  for (int i = 0; i < count; ++i) loseMarker(field, order[i]);
}

/// The parameter: the truncation.
class SolverTest : public testing::TestWithParam<double> {
 protected:
  SolverTest() { forces_.resize(sensor_.markerCount(), sensor_.nodes.count()); }

  static SolveOptions options() {
    SolveOptions options;
    options.truncation = GetParam();
    options.contactAware = false;
    return options;
  }

  VectorXd solved(const MarkerField& field) {
    solver_.solve(field, forces_);
    EXPECT_TRUE(forces_.valid);
    return VectorXf::Map(forces_.force_N.data(), influence_.cols()).cast<double>();
  }

  void expectTwins(const MarkerField& field) {
    const VectorXd actual = solved(field);
    const Solution expected = twin_.solve(field);
    EXPECT_LT((actual - expected.forces).norm(), 1e-4 * expected.forces.norm());
    EXPECT_NEAR(forces_.residual_px, expected.residual_px, 1e-2 * expected.residual_px);
  }

  const sensor::Sensor sensor_ = smallSensor();
  const MatrixXd influence_ = halfSpaceImage(sensor_, sensor::nodePositions(sensor_.nodes));
  const Inverse inverse_ = computeInverse(influence_, still(influence_.rows()), options()).value();
  const Twin twin_{influence_, options()};
  Solver solver_{inverse_, sensor_, options()};
  TractionField forces_;
  std::mt19937 random_{1};
};

INSTANTIATE_TEST_SUITE_P(Truncation, SolverTest, testing::Values(0.0, SolveOptions{}.truncation));

TEST_P(SolverTest, EqualsDenseLeastSquares) {
  for (int i = 0; i < 3; ++i) expectTwins(loaded(influence_, random_));
}

TEST_P(SolverTest, TakesMissingMarkersOutOfTheEquations) {
  for (const int count : {1, 2, 10, sensor_.markerCount() / 4}) {
    MarkerField scattered = loaded(influence_, random_);
    loseAtRandom(scattered, count, random_);
    expectTwins(scattered);
    MarkerField hole = loaded(influence_, random_);
    loseNearest(hole, sensor_, {2e-3, -1e-3}, count);
    expectTwins(hole);
    MarkerField corner = loaded(influence_, random_);
    loseNearest(corner, sensor_, {-20e-3, -20e-3}, count);
    expectTwins(corner);
  }
}

TEST_P(SolverTest, RemembersNothingOfMarkersThatCameAndWent) {
  const MarkerField whole = loaded(influence_, random_);
  std::uniform_int_distribution<int> marker(0, sensor_.markerCount() - 1);
  MarkerField field = whole;
  for (int frame = 0; frame < 300; ++frame) {
    for (int change = frame % 4; change > 0; --change) {
      const int changed = marker(random_);
      if (field.valid[changed] != 0 && field.validCount > sensor_.markerCount() * 3 / 4) {
        loseMarker(field, changed);
      } else if (field.valid[changed] == 0) {
        field.validCount += 1;
        field.valid[changed] = 1;
        for (const int i : {2 * changed, 2 * changed + 1}) field.displacement_px[i] = whole.displacement_px[i];
      }
    }
    solved(field);
    if (frame % 50 == 49) expectTwins(field);
  }
  expectTwins(whole);
}

TEST_P(SolverTest, IsolatedGapsOfTheZeroAreNotAmongTheMarkersThatMayBeMissing) {
  MarkerField field = loaded(influence_, random_);
  const int markers = sensor_.markerCount(), gaps = markers / 4, others = (markers - gaps) / 4;
  loseAtRandom(field, gaps + others, random_);
  field.isolatedGaps = gaps;
  expectTwins(field);
  loseAtRandom(field, 1, random_);
  solver_.solve(field, forces_);
  EXPECT_FALSE(forces_.valid);
  EXPECT_EQ(forces_.flags, kFewMarkers);
}

TEST_P(SolverTest, SumsAreThoseOfTheNodeForces) {
  solved(loaded(influence_, random_));
  const sensor::Points nodes = sensor::nodePositions(sensor_.nodes);
  Eigen::Vector3d resultant = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < nodes.cols(); ++n) {
    const Eigen::Vector3d force = Eigen::Vector3f::Map(forces_.force_N.data() + 3 * n).cast<double>();
    resultant += force;
    moment += nodes.col(n).cross(force);
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(forces_.resultant_N[axis], resultant[axis], 1e-12);
    EXPECT_NEAR(forces_.moment_Nm[axis], moment[axis], 1e-12);
  }
}

TEST_P(SolverTest, WithoutAPressThereIsNoCentre) {
  VectorXd forces = VectorXd::Zero(influence_.cols());
  for (const double normal : {0.0, 0.1, -2.0}) {
    forces[2] = normal;
    forces[0] = 1.0;
    solved(fieldOf(influence_ * forces));
    EXPECT_FALSE(forces_.centreOfPressureValid);
    EXPECT_EQ(forces_.centreOfPressure_m, (std::array<double, 2>{}));
  }
}

/// A larger hole in more markers: the small system is worse conditioned, the factor longer.
TEST(LargerSolver, TakesAHoleOutOfTheEquations) {
  sensor::Sensor sensor;
  for (sensor::MarkerLayer& layer : sensor.layers) layer.columns = layer.rows = 14;
  sensor.nodes.columns = sensor.nodes.rows = 12;
  const MatrixXd influence = halfSpaceImage(sensor, sensor::nodePositions(sensor.nodes));
  const SolveOptions options;
  const Inverse inverse = computeInverse(influence, still(influence.rows()), options).value();
  Solver solver(inverse, sensor, options);
  TractionField forces;
  forces.resize(sensor.markerCount(), sensor.nodes.count());
  std::mt19937 random(1);
  MarkerField field = loaded(influence, random);
  loseNearest(field, sensor, {15e-3, 0.0}, sensor.markerCount() / 4);
  solver.solve(field, forces);
  ASSERT_TRUE(forces.valid);
  const Solution expected = Twin(influence, options).solve(field);
  const VectorXd actual = VectorXf::Map(forces.force_N.data(), influence.cols()).cast<double>();
  EXPECT_LT((actual - expected.forces).norm(), 1e-4 * expected.forces.norm());
  EXPECT_NEAR(forces.residual_px, expected.residual_px, 1e-2 * expected.residual_px);
}

}  // namespace
}  // namespace tractiond::solve::solver_test
