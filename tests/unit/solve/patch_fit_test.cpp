// Patches against dense least squares, on a small sensor.
#include "daemon/solve/patch_fit.h"
#include "tests/unit/solve/sensors.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <random>

namespace tractiond::solve::patch_fit_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(Stencil, HasThePatchsMomentsAndTheirSlopes) {
  const Patch patch{9.3, 4.8, 0.4, {}};
  const Stencil stencil(patch, 24, 20);
  const auto sum = [&](std::size_t kind, auto value) {
    double result = 0.0;
    for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
      result += stencil.share[i][kind] * value(stencil.node[i] % 24 - patch.column, stencil.node[i] / 24 - patch.row);
    }
    return result;
  };
  const auto one = [](double, double) { return 1.0; };
  const auto x = [](double dx, double) { return dx; };
  const auto y = [](double, double dy) { return dy; };
  const auto xx = [](double dx, double) { return dx * dx; };
  const auto yy = [](double, double dy) { return dy * dy; };
  const auto xy = [](double dx, double dy) { return dx * dy; };
  const auto xxx = [](double dx, double) { return dx * dx * dx; };
  const double none = 1e-12;
  EXPECT_NEAR(sum(0, one), 1.0, none);
  EXPECT_NEAR(sum(0, x), 0.0, none);
  EXPECT_NEAR(sum(0, y), 0.0, none);
  EXPECT_NEAR(sum(0, xx), patch.spread, none);
  EXPECT_NEAR(sum(0, yy), patch.spread, none);
  EXPECT_NEAR(sum(0, xy), 0.0, none);
  EXPECT_NEAR(sum(0, xxx), 0.0, none);
  EXPECT_NEAR(sum(1, one), 0.0, none);
  EXPECT_NEAR(sum(1, x), 1.0, none);
  EXPECT_NEAR(sum(1, y), 0.0, none);
  EXPECT_NEAR(sum(2, y), 1.0, none);
  EXPECT_NEAR(sum(2, x), 0.0, none);
  EXPECT_NEAR(sum(3, one), 0.0, none);
  EXPECT_NEAR(sum(3, xx), 1.0, none);
  EXPECT_NEAR(sum(3, yy), 1.0, none);
}

class PatchFitTest : public testing::Test {
 protected:
  static constexpr double kNoise_px = 0.018;

  MotionPrior moving() {
    const auto any = [this] { return normal_(random_); };
    return {MatrixXd::NullaryExpr(influence_.rows(), kMotions, any), Eigen::Vector4d(1e-4, 1e-4, 2e-4, 3e-4)};
  }

  /// A patch's columns for unit forces, 2M x 3.
  MatrixXd image(const Patch& patch) const {
    const Stencil stencil(patch, sensor_.nodes.columns, sensor_.nodes.rows);
    MatrixXd result = MatrixXd::Zero(influence_.rows(), 3);
    for (std::size_t i = 0; i < Stencil::kNodes; ++i) {
      result += stencil.share[i][0] * influence_.middleCols<3>(3 * stencil.node[i]);
    }
    return result;
  }

  /// Shows the fit a picture of which the markers from `firstGone` on, every fifth, are missing.
  void show(const VectorXd& displacement, int firstGone) {
    for (auto* each : {&gone_, &there_}) each->clear();
    row_.assign(static_cast<std::size_t>(inverse_.influence.stride()), 0.0);
    for (int i = 0; i < displacement.size(); ++i) {
      const int marker = i / 2;
      const bool isGone = marker >= firstGone && marker % 5 == 0;
      (isGone ? gone_ : there_).push_back(i);
      if (!isGone) row_[i] = displacement[i];
    }
    seen_ = VectorXd::Map(row_.data(), displacement.size());
    VectorXd amplitudes = VectorXd::Zero(inverse_.left.stride());
    for (const int i : there_) {
      amplitudes += seen_[i] * Eigen::VectorXf::Map(inverse_.left.row(i), amplitudes.size()).cast<double>();
    }
    step_.find({amplitudes.data(), static_cast<std::size_t>(amplitudes.size())}, kNoise_px);
    ASSERT_TRUE(step_.solve(row_.data(), gone_, seen_.squaredNorm()));
    fit_.begin(step_, {row_.data(), gone_, seen_.squaredNorm(), kNoise_px});
  }

  /// What dense least squares for the forces and the motion leave at these places, without the spreads' prior.
  double left(std::span<Patch> patches) const {
    const auto forces = 3 * static_cast<Eigen::Index>(patches.size());
    MatrixXd a = MatrixXd::Zero(influence_.rows() + kMotions, forces + kMotions);
    for (std::size_t i = 0; i < patches.size(); ++i) {
      a.block(0, 3 * static_cast<Eigen::Index>(i), influence_.rows(), 3) = image(patches[i]);
    }
    a.topRightCorner(influence_.rows(), kMotions) = motion_.modes;
    a.bottomRightCorner(kMotions, kMotions) =
        MatrixXd(kNoise_px * motion_.variances.cwiseSqrt().cwiseInverse().asDiagonal());
    for (const int i : gone_) a.row(i).setZero();
    VectorXd right = VectorXd::Zero(a.rows());
    right.head(seen_.size()) = seen_;
    const VectorXd solution = a.colPivHouseholderQr().solve(right);
    for (std::size_t i = 0; i < patches.size(); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        patches[i].force_N[axis] = solution[static_cast<Eigen::Index>(3 * i + axis)];
      }
    }
    return (right - a * solution).squaredNorm() / (kNoise_px * kNoise_px);
  }

  VectorXd noise() {
    return VectorXd::NullaryExpr(influence_.rows(), [this] { return kNoise_px * normal_(random_); });
  }

  std::mt19937 random_{3};
  std::normal_distribution<double> normal_;
  const sensor::Sensor sensor_ = smallSensor();
  const MatrixXd influence_ =
      halfSpaceImage(sensor_, sensor::nodePositions(sensor_.nodes)).cast<float>().cast<double>();
  const MotionPrior motion_ = moving();
  const Inverse inverse_ = computeInverse(influence_, motion_, SolveOptions{}).value();
  ContactStep step_{inverse_, sensor_.nodes, SolveOptions{}};
  PatchFit fit_{inverse_, sensor_.nodes};
  std::vector<int> gone_, there_;
  std::vector<double> row_;
  VectorXd seen_;
};

double priorOf(std::span<const Patch> patches) {
  double sum = 0.0;
  for (const Patch& patch : patches) {
    const double off = (patch.spread - PatchFit::kSpread) / PatchFit::kSpreadDeviation;
    sum += off * off;
  }
  return sum;
}

TEST_F(PatchFitTest, FindsTheLeastOfDenseLeastSquaresWhateverIsMissing) {
  const Patch left{1.7, 2.2, 0.05, {}}, right{4.4, 2.9, 0.2, {}};
  const VectorXd picture = image(left) * Eigen::Vector3d(0.1, -0.2, 1.0) +
                           image(right) * Eigen::Vector3d(0.3, 0.1, 0.6) +
                           motion_.modes * Eigen::Vector4d(0.01, -0.005, 0.01, 0.02) + noise();
  for (const int firstGone : {1000, 50, 0}) {
    show(picture, firstGone);
    std::array<Patch, 2> patches = {Patch{2.1, 2.5, 0.1, {}}, Patch{4.0, 2.5, 0.1, {}}};
    ASSERT_TRUE(fit_.fit(patches, 1e9));
    EXPECT_NEAR(patches[0].column, left.column, 0.1);
    EXPECT_NEAR(patches[1].row, right.row, 0.1);

    auto dense = patches;
    const double least = this->left(dense) + priorOf(dense);
    EXPECT_NEAR(fit_.chiSquared(), least, 1e-3 * least);
    for (std::size_t i = 0; i < 2; ++i) {
      const auto covariance = fit_.covariance(static_cast<int>(i));
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(patches[i].force_N[axis], dense[i].force_N[axis], 1e-3);
      }
      constexpr std::array kPlaces = {&Patch::column, &Patch::row, &Patch::spread};
      for (std::size_t k = 0; k < kPlaces.size(); ++k) {
        const double deviation = std::sqrt(covariance(3 + static_cast<int>(k), 3 + static_cast<int>(k)));
        for (const double sign : {-1.0, 1.0}) {
          auto other = patches;
          other[i].*kPlaces[k] += sign * deviation;
          const double more = this->left(other) + priorOf(other) - least;
          EXPECT_GT(more, 0.9) << i << " " << k;  // 1 if nothing else gave way, less is impossible
        }
      }
    }
  }
}

TEST_F(PatchFitTest, KnowsABarFromAPair) {
  const auto at = [](double place) { return Patch{1.3 + 3.5 * place, 2.2 + 0.9 * place, 0.05, {}}; };
  VectorXd bar = noise(), pair = noise();
  constexpr int kPoints = 40;
  for (int i = 0; i < kPoints; ++i) bar += image(at((i + 0.5) / kPoints)) * Eigen::Vector3d(0.0, 0.3, 2.0) / kPoints;
  for (const double place : {0.1, 0.9}) pair += image(at(place)) * Eigen::Vector3d(0.0, 0.3, 1.0);
  for (const bool isBar : {true, false}) {
    show(isBar ? bar : pair, 50);
    std::array<Patch, 2> patches = {at(0.2), at(0.8)};
    ASSERT_TRUE(fit_.fit(patches, 1e9));
    std::array<Patch, 2> ends = {at(0.1), at(0.9)};
    EXPECT_EQ(fit_.fitsBar(ends, 0, fit_.chiSquared() + 25.0), isBar);
  }
}

TEST_F(PatchFitTest, GivesUpWhereItWillNotDo) {
  show(image({3.0, 2.5, 1.0, {}}) * Eigen::Vector3d(0.0, 0.0, 4.0) + noise(), 1000);
  std::array<Patch, 1> patches = {Patch{1.0, 1.0, 0.1, {}}};
  EXPECT_FALSE(fit_.fit(patches, 1.0));
}

}  // namespace
}  // namespace tractiond::solve::patch_fit_test
