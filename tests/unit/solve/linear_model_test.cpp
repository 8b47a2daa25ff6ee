// Answers by the model of an earlier picture, against a whole solve, and against forces that are known.
#include "daemon/solve/linear_model.h"
#include "tests/unit/solve/linear_bench.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace tractiond::solve {
namespace {

struct LinearCase {
  const char* name;
  bool hasPatches;
  Load load;
};

std::vector<LinearCase> linearCases() {
  return {{"a press", true, disc(1, 2, 2, kPress + 0.3 * kShear, 0.5)},
          {"a strong press", true, disc(1, 2, 2, 10 * kPress + 3 * kShear, 5)},
          {"two contacts", true, both(disc(-6, -4, 2, 0.5 * kPress), disc(6, 4, 2, kPress))},
          {"an even contact", true, disc(0.5, -0.7, 9, 6 * kPress)},
          {"a field", false, both(square(-2, 1, 5, 2), {{4, -3, 0.3 * kShear}})}};
}

/// Deviations of the nodes, and covariance of functionals of the points.
std::pair<VectorXd, RowMajor> covariancesOf(Mixture& mixture, const Atoms& atoms) {
  VectorXd nodes(3 * atoms.nodeCount());
  mixture.nodeDeviations_N(all(nodes));
  const auto [weights, points] = functionals(atoms);
  RowMajor covariance(kColumns, kColumns);
  mixture.covariance(all(weights), points, all(covariance));
  return {nodes, covariance};
}

Eigen::Matrix<double, kPerPatch, 1> valuesOf(const FoundPatch& patch) {
  Eigen::Matrix<double, kPerPatch, 1> values;
  values << patch.patch.load, patch.patch.place.x_m, patch.patch.place.y_m, patch.patch.place.spread_m2;
  return values;
}

void expectRatios(const VectorXd& found, const VectorXd& expected, double tolerance) {
  EXPECT_GT((found.array() / expected.array()).minCoeff(), 1.0 - tolerance);
  EXPECT_LT((found.array() / expected.array()).maxCoeff(), 1.0 + tolerance);
}

TEST(LinearModel, BoundsVariancesFromBelow) {
  for (const auto& [name, hasPatches, load] : linearCases()) {
    LinearBench bench(hasPatches);
    for (const std::vector<int>& missing : {std::vector<int>{}, missingOf(bench.sensor())}) {
      SCOPED_TRACE(testing::Message() << name << ", " << missing.size() << " missing");
      const VectorXd picture = bench.picture(load, 3);
      bench.make(picture, {});
      ASSERT_TRUE(bench.answer(picture, missing));
      const auto [nodes, covariance] = covariancesOf(bench.linear().mixture(), bench.atoms());
      const auto [weights, points] = functionals(bench.atoms());
      VectorXd least(kColumns);
      bench.linear().mixture().leastVariances(all(weights), points, all(least));
      EXPECT_LT((least.array() / covariance.diagonal().array()).maxCoeff(), 1.0 + 1e-9);
      EXPECT_GT((least.array() / covariance.diagonal().array()).maxCoeff(), 0.05) << "is of no use";
    }
  }
}

/// But for what it leaves to the prior, with loads about 0 instead of about the fit: a tenth of a variance, hence up to
/// the root of this of a deviation.
TEST(LinearModel, AnswersItsOwnPictureAsTheSolveDid) {
  constexpr double kVariance = 0.2, kDeviations = 0.45;
  for (const auto& [name, hasPatches, load] : linearCases()) {
    LinearBench bench(hasPatches);
    for (const std::vector<int>& missing : {std::vector<int>{}, missingOf(bench.sensor())}) {
      SCOPED_TRACE(testing::Message() << name << ", " << missing.size() << " missing");
      const VectorXd picture = bench.picture(load, 3);
      const Estimate solved = bench.make(picture, missing);
      ASSERT_TRUE(bench.answer(picture, missing));
      const Estimate& again = bench.later();
      EXPECT_LT(differenceInDeviations(solved, wrenchOf(again)), kDeviations);
      expectRatios(covarianceOf(again).diagonal(), covarianceOf(solved).diagonal(), kVariance);
      EXPECT_NEAR(again.patchShare, solved.patchShare, 0.02);
      EXPECT_NEAR(again.evenShare, solved.evenShare, 0.02);
      EXPECT_NEAR(again.squaredResidual_px2, solved.squaredResidual_px2, 0.05 * solved.squaredResidual_px2);
      EXPECT_EQ(again.atoms, solved.atoms);
      EXPECT_EQ(again.rounds, solved.rounds);
      const auto [nodes, ofFunctionals] = covariancesOf(bench.model().mixture(), bench.atoms());
      const auto [nodesAgain, ofFunctionalsAgain] = covariancesOf(bench.linear().mixture(), bench.atoms());
      EXPECT_LT((nodesAgain - nodes).cwiseAbs().maxCoeff(), kVariance / 2.0 * nodes.maxCoeff());
      EXPECT_LT((nodeForces(again, bench.atoms()) - nodeForces(solved, bench.atoms())).cwiseAbs().maxCoeff(),
                kDeviations * nodes.maxCoeff());
      expectRatios(ofFunctionalsAgain.diagonal(), ofFunctionals.diagonal(), kVariance);
      ASSERT_EQ(again.patchCount, solved.patchCount);
      for (std::size_t k = 0; k < static_cast<std::size_t>(solved.patchCount); ++k) {
        const FoundPatch &now = again.patches[k], &then = solved.patches[k];
        EXPECT_EQ(now.contact, then.contact);
        const VectorXd variance = then.covariance.diagonal();
        EXPECT_LT(((valuesOf(now) - valuesOf(then)).array() / variance.array().sqrt()).abs().maxCoeff(), kDeviations);
        expectRatios(now.covariance.diagonal(), variance, kVariance);
      }
    }
  }
}

/// The truth is that of the loads, not of another solve.
TEST(LinearModel, CoversWhatALaterPictureShows) {
  for (const auto& [name, hasPatches, load] : linearCases()) {
    LinearBench bench(hasPatches);
    const std::vector<int> none, holes = missingOf(bench.sensor()),
                                 others = everySeventh(bench.factors().coordinateCount());
    struct Later {
      const char* name;
      Load load;
      double noise_px, scale;
    };
    const std::vector<Later> pictures = {
        {"the same", load, kNoise_px, 1.0},
        {"more noise", load, 1.5 * kNoise_px, 1.0},
        {"a larger load", moved(load, 0.0, 0.0, 1.5), kNoise_px, 1.5},
        {"half of the load", moved(load, 0.0, 0.0, 0.5), kNoise_px, 1.0},
        {"nothing", {}, kNoise_px, 1.0},
        {"another place", moved(load, 0.42, -0.42), kNoise_px, 1.0},  // a fifth of a pitch away
        {"all at once", moved(load, 0.42, -0.42, 1.5), 1.5 * kNoise_px, 1.5},
    };
    unsigned seed = 100;
    for (unsigned first = 1; first <= 2; ++first) {
      const bool isWhole = first == 1;
      bench.make(bench.picture(load, first), isWhole ? none : holes);
      for (const auto& [what, now, noise_px, scale] : pictures) {
        SCOPED_TRACE(testing::Message() << name << ", " << what << ", " << (isWhole ? "whole" : "with holes"));
        const bool holds = bench.answer(bench.picture(now, ++seed, noise_px), isWhole ? none : others, noise_px);
        EXPECT_TRUE(holds);
        EXPECT_LT(differenceInDeviations(bench.later(), wrenchOf(now)), 4.0);
        EXPECT_NEAR(bench.linear().doubt().scale, scale, 0.25 * scale);
        if (!now.empty() && bench.later().patchShare > 0.5 && bench.later().patchCount == 1) {
          const FoundPatch& found = bench.later().patches[0];
          const PatchPlace& place = found.patch.place;
          const Eigen::Vector2d off = Eigen::Vector2d(place.x_m, place.y_m) - centreOf_m(now);
          for (Index i = 0; i < 2; ++i) EXPECT_LT(std::abs(off[i]), 4.0 * std::sqrt(found.covariance(4 + i, 4 + i)));
        }
      }
      // What a field has room for is covered as well; else it is not accepted.
      for (const Load& now : {both(load, disc(-8, 7, 1.5, 0.3 * kPress)), both(load, disc(4, -3, 1.5, 0.3 * kPress)),
                              moved(load, 6.0, 0.0)}) {
        if (!bench.answer(bench.picture(now, ++seed), isWhole ? none : others)) continue;
        EXPECT_LT(differenceInDeviations(bench.later(), wrenchOf(now)), 4.0) << name;
      }
    }
  }
}

TEST(LinearModel, IsNotAcceptedWhereThePictureContradictsIt) {
  const Bench otherGel(smallSensor(), everyMode(), halfSpaceImage);
  for (const Load& load :
       {disc(1, 2, 2, kPress + 0.3 * kShear), both(disc(-6, -4, 2, 0.5 * kPress), disc(6, 4, 2, kPress))}) {
    LinearBench bench;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      bench.make(bench.picture(load, seed));
      const VectorXd picture = bench.picture(load, seed + 10);
      EXPECT_TRUE(bench.answer(picture));
      const auto isAccepted = [&](const Load& now) { return bench.answer(bench.picture(now, seed + 20)); };
      // Another contact, far from the first, near it, and so faint that the misfit does not tell.
      EXPECT_FALSE(isAccepted(both(load, disc(-8, 7, 1.5, 0.3 * kPress))));
      EXPECT_FALSE(isAccepted(both(load, disc(4, -3, 1.5, 0.3 * kPress))));
      EXPECT_FALSE(isAccepted(both(load, disc(-8, 7, 1.5, 0.1 * kPress))));
      EXPECT_FALSE(isAccepted(moved(load, 6.0, 0.0)));  // two pitches away
      EXPECT_FALSE(isAccepted(moved(load, 0.0, 0.0, 2.5)));
      // more than its prior allows
      EXPECT_FALSE(bench.answer(otherGel.picture(moved(load, 0.0, 0.0, 1.9), seed)));
      // Markers that scatter more than is said of them.
      EXPECT_FALSE(bench.answer(bench.picture(load, seed + 30, 1.5 * kNoise_px)));
      VectorXd broken = picture;
      broken[17] = std::numeric_limits<double>::quiet_NaN();
      EXPECT_FALSE(bench.answer(broken));
      EXPECT_TRUE(bench.answer(picture));
    }
  }
}

}  // namespace
}  // namespace tractiond::solve
