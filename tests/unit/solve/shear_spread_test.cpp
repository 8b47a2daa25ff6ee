// How far the shear of a ball's contact is spread, by Mindlin's tractions on a half-space.
#include "daemon/solve/linear_model.h"
#include "tests/unit/solve/presses.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

namespace tractiond::solve {
namespace {

constexpr double kNormal_N = 4.0, kFriction = 0.5, kRadius_m = 5e-3;

/// Displacements by a ball's contact under shear along a direction: q = mu (p(a) - s^3 p(s a)), s the stick ratio.
VectorXd pictureOf(const Vector2d& at, const Vector2d& along, double stickRatio, double radius_m = kRadius_m) {
  const Vector3d shear = kFriction * kNormal_N * Vector3d(along.x(), along.y(), 0.0);
  VectorXd picture = press(at, radius_m).image * (shear + kNormal_N * Vector3d::UnitZ());
  if (stickRatio > 0.0) picture -= std::pow(stickRatio, 3) * press(at, stickRatio * radius_m).image * shear;
  return picture;
}

/// Answers a picture by the model of another one of the same load.
class ShearSpreadTest : public PressTest {
 protected:
  ShearSpreadTest()
      : model_(paper(), paperFactors(), paperAtoms(), options_)
      , modes_(paperFactors(), paperAtoms(), options_)
      , linear_(paperFactors(), paperAtoms(), modes_.strong()) {
    estimate_.force_N.resize(3 * static_cast<std::size_t>(paperAtoms().pointCount()));
  }

  SpreadRatio found(const VectorXd& truth, const std::vector<int>& missing = {}) {
    const Picture then(paperFactors(), truth + noise(), {}, kNoise_px);
    model_.solve(then, estimate_);
    EXPECT_TRUE(linear_.make(model_, estimate_, scratch_));
    const Picture now(paperFactors(), truth + noise(), missing, kNoise_px);
    modes_.look(now);
    EXPECT_TRUE(linear_.answer(now, modes_, estimate_));
    EXPECT_EQ(estimate_.patchCount, 1);
    return estimate_.patches[0].spreadRatio;
  }

  Vector2d direction() {
    const double angle = 2.0 * std::numbers::pi * uniform_(random_);
    return {std::cos(angle), std::sin(angle)};
  }
  Vector2d place() { return {12e-3 * (uniform_(random_) - 0.5), 12e-3 * (uniform_(random_) - 0.5)}; }

 private:
  const SolveOptions options_ = SolveOptions{};
  Model model_;
  Modes modes_;
  LinearModel linear_;
  LinearScratch scratch_;
  Estimate estimate_;
  std::uniform_real_distribution<double> uniform_;
};

TEST_F(ShearSpreadTest, IsThatOfMindlinsTractions) {
  constexpr int kTrials = 12;
  for (const double stickRatio : {0.0, 0.4, 0.67}) {
    SCOPED_TRACE(stickRatio);
    const double expected = (1.0 - std::pow(stickRatio, 5)) / (1.0 - std::pow(stickRatio, 3));
    double sum = 0.0;
    int covered = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const SpreadRatio ratio = found(pictureOf(place(), direction(), stickRatio));
      EXPECT_LT(ratio.deviation, 0.1);
      sum += ratio.value;
      covered += std::abs(ratio.value - expected) < 1.96 * ratio.deviation;
    }
    EXPECT_NEAR(sum / kTrials, expected, 0.04);
    EXPECT_GE(covered, kTrials - 2);
  }
}

TEST_F(ShearSpreadTest, OfAWideContactCountsWhatLiesBesideThePatch) {
  constexpr int kTrials = 8;
  double sum = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) sum += found(pictureOf(place(), direction(), 0.4, 6.8e-3)).value;
  EXPECT_NEAR(sum / kTrials, (1.0 - std::pow(0.4, 5)) / (1.0 - std::pow(0.4, 3)), 0.03);
}

TEST_F(ShearSpreadTest, IsFoundWithMarkersMissing) {
  std::vector<int> missing;
  for (int i = 0; i < 2 * paper().markerCount(); i += 20) missing.insert(missing.end(), {i, i + 1});
  const SpreadRatio ratio = found(pictureOf({1e-3, 2e-3}, Vector2d::UnitX(), 0.4), missing);
  EXPECT_NEAR(ratio.value, 1.06, 2.0 * ratio.deviation);
  EXPECT_LT(ratio.deviation, 0.1);
}

TEST_F(ShearSpreadTest, IsUncertainWithoutShear) {
  const SpreadRatio ratio = found(press(Vector2d(2e-3, -1e-3), kRadius_m).image.col(2) * kNormal_N);
  EXPECT_GT(ratio.deviation, 0.4);
}

}  // namespace
}  // namespace tractiond::solve
