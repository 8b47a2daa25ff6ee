// The block's field is checked from outside: against independent solutions (finite elements, the infinite layer, the
// half-space).
#include "sensor/elastic/block.h"
#include "sensor/elastic/half_space.h"
#include "sensor/elastic/loads.h"
#include "tests/support/places.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <sstream>

namespace sensor::elastic {
namespace {

using Eigen::Index, Eigen::Matrix3d, Eigen::MatrixXd, Eigen::Vector3d;

Gel block(double width_mm, double thickness_mm, double poissonRatio) {
  Gel gel;
  gel.size = Vector3d(width_mm, width_mm, thickness_mm) * 1e-3;
  gel.poissonRatio = poissonRatio;
  return gel;
}

Points points(const std::vector<Vector3d>& list_mm) {
  Points result(3, static_cast<Index>(list_mm.size()));
  for (std::size_t i = 0; i < list_mm.size(); ++i) result.col(static_cast<Index>(i)) = list_mm[i] * 1e-3;
  return result;
}

// A grid of (2 n + 1)^2 points in each of the depths.
Points grid(double reach_mm, int n, const std::vector<double>& depths_mm) {
  std::vector<Vector3d> list;
  for (const double depth : depths_mm)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) list.emplace_back(reach_mm * i / n, reach_mm * j / n, depth);
  return points(list);
}

Matrix3d at(const MatrixXd& u, Index target, Index source = 0) {
  return u.block<3, 3>(3 * target, 3 * source);
}

// Largest distance of two fields over the targets, in parts of the second one's largest displacement; the worst force.
double worstError(const MatrixXd& u, const MatrixXd& exact) {
  double worst = 0.0;
  for (Index column = 0; column < u.cols(); ++column) {
    const auto norms = [&](const MatrixXd& m) { return m.col(column).reshaped(3, m.rows() / 3).colwise().norm(); };
    worst = std::max(worst, norms(u - exact).maxCoeff() / norms(exact).maxCoeff());
  }
  return worst;
}

TEST(Block, SolvesForSourcesAsForTargets) {
  const Points targets = grid(20, 2, {4, 6}), sources = points({{0, 0, 0}, {4, -7, 0}, {-13, 2.5, 0}});
  BlockOptions options;
  options.degree = 4;
  const MatrixXd byTargets = BlockCorrection(block(60, 15, 0.48), targets, options).matrix(sources);
  options.solveForSources = true;
  EXPECT_LT(worstError(BlockCorrection(block(60, 15, 0.48), targets, options).matrix(sources), byTargets), 1e-10);
}

TEST(Block, TurnsWithItsAxes) {
  Gel gel = block(100, 30, 0.45), turned = gel;
  gel.size.x() = 70e-3;
  turned.size.y() = 70e-3;
  Matrix3d turn;  // by a right angle
  turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Points targets = points({{3, 4, 6}, {-20, 11, 8}, {30, -40, 25}}), source = points({{6, -13, 0}});
  const MatrixXd u = blockDisplacement(gel, targets, source, 4);
  const MatrixXd v = blockDisplacement(turned, turn * targets, turn * source, 4);
  for (Index t = 0; t < targets.cols(); ++t)
    EXPECT_LT((at(v, t) - turn * at(u, t) * turn.transpose()).norm(), 1e-9 * at(u, t).norm());
}

TEST(Block, AgreesWithFiniteElements) {
  std::ifstream file(tractiond::test::source("tests/golden/block_reference.csv"));
  ASSERT_TRUE(file);
  std::string line;
  std::getline(file, line);
  std::vector<Vector3d> places_mm;
  std::vector<Vector3d> reference[2];  // [mm]
  while (std::getline(file, line)) {
    std::istringstream row(line);
    std::string name, layer, number;
    std::getline(row, name, ',');
    std::getline(row, layer, ',');
    double value[6];
    for (double& v : value) std::getline(row, number, ','), v = std::stod(number);
    if (name == "A") places_mm.emplace_back(value[0], value[1], value[2]);
    reference[name == "A" ? 0 : 1].emplace_back(value[3], value[4], value[5]);
  }
  ASSERT_EQ(places_mm.size(), 1152U);
  Gel gel = block(100, 40, 0.49);
  gel.youngsModulus = 0.018e6;
  const Points targets = points(places_mm);
  const BlockCorrection correction(gel, targets);
  for (const int load : {0, 1}) {
    const Vector3d force = load == 0 ? Vector3d::UnitZ() : Vector3d::UnitX();
    const PatchQuadrature patch = hertz({0.7e-3, 0.4e-3}, 2.5e-3, force);
    const Points w = (correction.matrix(patch.points) * patch.forces.reshaped()).reshaped(3, targets.cols());
    double error = 0.0, peak = 0.0;
    for (Index t = 0; t < targets.cols(); ++t) {
      Vector3d u = w.col(t);
      for (Index p = 0; p < patch.points.cols(); ++p)
        u += halfSpaceDisplacement(targets.col(t) - patch.points.col(p), gel.youngsModulus, gel.poissonRatio) *
             patch.forces.col(p);
      error = std::max(error, (u * 1e3 - reference[load][t]).norm());
      peak = std::max(peak, reference[load][t].norm());
    }
    std::printf("case %c: largest error %.4f %% of the peak\n", "AB"[load], 100.0 * error / peak);
    EXPECT_LT(error, 1e-3 * peak);
  }
}

// Displacement [um/N] in an infinite layer bonded at its base, E = 0.18 MPa, nu = 0.49, by Hankel transforms.
struct LayerCase {
  double thickness_mm;
  Vector3d target_mm;
  Matrix3d displacement_um;
};

TEST(Block, WideBlockIsTheInfiniteLayer) {
  const auto rows = [](std::initializer_list<double> v) {
    return Matrix3d(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.begin()));
  };
  const std::vector<LayerCase> cases = {
      {40, {3, 0, 6}, rows({204.86, 0, 78.48, 0, 165.80, 0, 77.92, 0, 295.19})},
      {40, {4.5, -6, 6}, rows({136.31, -39.85, 40.60, -39.85, 159.56, -54.13, 38.64, -51.52, 132.26})},
      {40, {3, 0, 8}, rows({142.28, 0, 50.89, 0, 123.37, 0, 49.62, 0, 229.19})},
      {40, {4.5, -6, 8}, rows({109.45, -26.80, 36.50, -26.80, 125.08, -48.67, 34.15, -45.53, 124.33})},
      {15, {3, 0, 6}, rows({151.59, 0, 81.46, 0, 112.55, 0, 66.47, 0, 183.82})},
      {15, {4.5, -6, 6}, rows({87.44, -39.58, 43.68, -39.58, 110.52, -58.24, 24.66, -32.88, 41.70})},
  };
  for (const auto& [width_mm, thickness_mm] : {std::pair{400.0, 40.0}, {200.0, 15.0}}) {
    std::vector<Vector3d> targets_mm;
    for (const LayerCase& layer : cases)
      if (layer.thickness_mm == thickness_mm) targets_mm.push_back(layer.target_mm);
    const MatrixXd u =
        1e6 * blockDisplacement(block(width_mm, thickness_mm, 0.49), points(targets_mm), points({{0, 0, 0}}));
    Index target = 0;
    for (const LayerCase& layer : cases) {
      if (layer.thickness_mm != thickness_mm) continue;
      const Matrix3d& exact = layer.displacement_um;
      const double error = (at(u, target++) - exact).cwiseAbs().maxCoeff() / exact.maxCoeff();
      std::printf("%3.0f mm wide, %2.0f mm thick: %.4f %% off the layer\n", width_mm, thickness_mm, 100 * error);
      EXPECT_LT(error, 1e-3) << layer.target_mm.transpose();
    }
  }
}

}  // namespace
}  // namespace sensor::elastic
