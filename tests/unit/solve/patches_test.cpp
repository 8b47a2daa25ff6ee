// Round patches as the mean of the prior, against the loads that are known.
#include "tests/unit/solve/model_bench.h"

#include <gtest/gtest.h>

namespace tractiond::solve {
namespace {

using Outcome = Estimate::Outcome;

/// The cubics, and the ring that stands for a ball's pressure.
TEST(PatchInfluence, IsThatOfABall) {
  PatchBench bench;
  PatchInfluence influence(bench.sensor(), bench.atoms(), bench.factors());
  constexpr double kRadius_mm = 3.0, kX_mm = 2.2, kY_mm = -1.1;
  std::vector<double> column(influence.stride());
  influence.displacement({1e-3 * kX_mm, 1e-3 * kY_mm, 1e-6 * kRadius_mm * kRadius_mm / 5.0}, {0.3, 0.0, 1.0, 0.0},
                         column.data());
  // Hertz: the force within r is 1 - (1 - r^2 / a^2)^(3/2).
  VectorXd expected = VectorXd::Zero(bench.influence().rows());
  constexpr int kRings = 20, kAround = 24;
  const auto within = [](double share) { return 1.0 - std::pow(1.0 - share * share, 1.5); };
  for (int ring = 0; ring < kRings; ++ring) {
    const double part = within((ring + 1.0) / kRings) - within(static_cast<double>(ring) / kRings);
    for (int i = 0; i < kAround; ++i) {
      const double angle = 2.0 * 3.14159265358979323846 * i / kAround, r_mm = kRadius_mm * (ring + 0.5) / kRings;
      const Vector3d at(1e-3 * (kX_mm + r_mm * std::cos(angle)), 1e-3 * (kY_mm + r_mm * std::sin(angle)), 0.0);
      expected += part / kAround * blockImage(bench.sensor(), at) * Vector3d(0.3, 0.0, 1.0);
    }
  }
  EXPECT_LT((VectorXd::Map(column.data(), expected.size()) - expected).norm(), 1e-3 * expected.norm());
}

using NamedLoads = std::vector<std::pair<const char*, Load>>;

/// Expects what acts to be within what is stated of each load. Returns the number of those for which `is` is true.
template <typename Is>
int countWhereTrue(const NamedLoads& loads, unsigned seed, Is is) {
  PatchBench bench;
  int count = 0;
  for (const auto& [name, load] : loads) {
    SCOPED_TRACE(name);
    const Estimate estimate = bench.solve(bench.picture(load, seed++));
    EXPECT_EQ(estimate.outcome, Outcome::kFound);
    EXPECT_LT(differenceInDeviations(estimate, wrenchOf(load)), 4.0);
    count += is(estimate) ? 1 : 0;
  }
  return count;
}

TEST(Patches, StandForRoundContactsWithinWhatIsStated) {
  const NamedLoads loads = {
      {"in the middle", disc(1, 2, 2, kPress)},
      {"with friction", disc(-2.5, 0.5, 2.5, kPress + 0.4 * kShear)},
      {"turning", disc(0.7, -1.2, 3, kPress, 1.0)},
      {"at a side", disc(8.5, 0.5, 2, kPress)},
      {"in a corner", disc(-8.5, -7, 2, 0.5 * kPress + 0.1 * kAcross)},
      {"two", both(disc(-6, -4, 2, 0.5 * kPress), disc(6, 4, 1.5, kPress))},
      {"two close to each other", both(disc(-3, 0.5, 1.5, kPress), disc(3, -0.5, 1.5, 0.8 * kPress + 0.2 * kShear))},
      {"weak beside strong", both(disc(-6, -4, 2, kPress), disc(7, 5, 1.5, 0.06 * kPress))},
      {"weak", disc(3, -3, 2, 0.05 * kPress)},
      {"a bar", both(both(disc(-4, 0, 2, kPress), disc(0, 0, 2, kPress)), disc(4, 0, 2, kPress))},
      {"broad", square(0, 0, 7, 2)},
  };
  EXPECT_EQ(countWhereTrue(loads, 1, [](const Estimate& one) { return one.patchShare > 0.5; }), 8);
}

/// An even pressure on a ring.
Load ring(double x_mm, double y_mm, double radius_mm, const Vector3d& force_N) {
  Load load;
  constexpr int kPoints = 36;
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2.0 * 3.14159265358979323846 * i / kPoints;
    load.push_back({x_mm + radius_mm * std::cos(angle), y_mm + radius_mm * std::sin(angle), force_N / kPoints});
  }
  return load;
}

TEST(EvenField, StandsForBroadContactsWithinWhatIsStated) {
  const NamedLoads loads = {
      {"disc", disc(0.5, -0.7, 9, 6 * kPress)},
      {"sheared", disc(-1, 0.5, 9, 3 * kPress + 3 * kShear)},
      {"square", square(0.7, 0, 8, 6)},
      {"ring", ring(0.5, 0.5, 8, 6 * kPress)},
      {"beside a ball", both(square(-4, 3, 6, 6), disc(8, -8, 1, 0.4 * kPress))},
      {"partly beyond the nodes", square(8, 2, 7, 6)},
  };
  EXPECT_EQ(countWhereTrue(loads, 50, [](const Estimate& one) { return one.evenShare > 0.5; }), 4);
}

/// Within an even contact the nodes' forces are alike.
TEST(EvenField, IsEven) {
  PatchBench bench;
  Bench alone(smallSensor(), everyMode(), blockImage);
  const auto unevenness = [&](const Estimate& estimate) {
    std::vector<double> within;
    for (int p = 0; p < bench.atoms().pointCount(); ++p) {
      if (bench.atoms().points.col(p).head<2>().norm() < 4.5e-3) within.push_back(forcesOf(estimate)[3 * p + 2]);
    }
    const VectorXd forces = VectorXd::Map(within.data(), std::ssize(within));
    return std::sqrt((forces.array() / forces.mean() - 1.0).square().mean());
  };
  double with = 0.0, without = 0.0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    const VectorXd displacement = bench.picture(disc(0, 0, 7.5, 6 * kPress), seed);
    const Estimate estimate = bench.solve(displacement);
    EXPECT_GT(estimate.evenShare, 0.5);
    EXPECT_LT(unevenness(estimate), 0.1);
    with += unevenness(estimate);
    without += unevenness(alone.solve(displacement));
  }
  EXPECT_LT(with, 0.4 * without);
}

/// A field may have maxima where nothing touches.
TEST(Patches, AreAsManyAsThePictureTells) {
  PatchBench bench;
  RoundPatches patches(bench.sensor(), bench.atoms(), bench.factors());
  const auto countOf = [&](const Load& load, std::initializer_list<Vector3d> maxima) {
    const Picture picture(bench.factors(), bench.picture(load, 7), {}, kNoise_px);
    std::vector<double> forces(3 * bench.atoms().pointCount());
    for (const Vector3d& each : maxima) {
      const VectorXd away =
          (bench.atoms().points.colwise() - 1e-3 * Vector3d(each.x(), each.y(), 0.0)).colwise().norm();
      Eigen::Index nearest = 0;
      away.minCoeff(&nearest);
      forces[3 * nearest + 2] = each.z();
    }
    const bool found = patches.find(picture, forces, 1e9);
    return found ? static_cast<int>(patches.patches().size()) : 0;
  };
  const Load corner = disc(-8.5, -7, 2, 0.5 * kShear),
             pair = both(disc(-6, -4, 2, kPress), disc(6, 4, 2, 0.05 * kPress));
  EXPECT_EQ(countOf(corner, {{-8.5, -7, 0.5}, {-12, -12, 0.1}}), 1);
  EXPECT_EQ(countOf(corner, {{-8.5, -7, 0.5}, {-12, -12, 0.1}, {6, 6, 0.1}, {-6, 9, 0.1}}), 1);
  EXPECT_EQ(countOf(pair, {{-6, -4, 1.0}, {6, 4, 0.3}, {9, -9, 0.15}}), 2);
}

TEST(Patches, TakeOutMissingMarkersAsEvenContactsDo) {
  PatchBench bench;
  unsigned seed = 30;
  for (const Load& load :
       {disc(4, 3, 2, kPress), disc(-8, 1, 2.5, kPress + 0.3 * kShear, 0.5),
        both(disc(-6, -4, 2, 0.5 * kPress), disc(5, 3, 2, kPress)), disc(0.5, -0.7, 9, 10 * kPress)}) {
    const VectorXd displacement = bench.picture(load, seed++);
    const Estimate estimate = bench.solve(displacement, missingOf(smallSensor())), whole = bench.solve(displacement);
    EXPECT_EQ(estimate.patchCount, whole.patchCount);
    EXPECT_GT(std::max(estimate.patchShare, estimate.evenShare), 0.9);
    EXPECT_LT(differenceInDeviations(estimate, wrenchOf(load)), 4.0);
    EXPECT_GT(differenceInDeviations(estimate, wrenchOf(whole)), 0.2);
    EXPECT_GT(covarianceOf(estimate).determinant(), covarianceOf(whole).determinant());
  }
}

/// Forces and moments of a ball are found within what is stated of them, and the field alone states more.
TEST(Patches, NarrowWhatIsStated) {
  PatchBench bench;
  Bench alone(smallSensor(), everyMode(), blockImage);
  double squares = 0.0;
  constexpr int kFrames = 12;
  for (unsigned seed = 1; seed <= kFrames; ++seed) {
    const double x_mm = 0.9 * seed - 6.0, y_mm = 4.0 - 0.6 * seed;
    const VectorXd displacement = bench.picture(disc(x_mm, y_mm, 2, kPress), seed);
    const Estimate estimate = bench.solve(displacement);
    ASSERT_GT(estimate.patchShare, 0.9);
    Eigen::Matrix<double, 6, 1> wrench;
    wrench << 0, 0, 1, 1e-3 * y_mm, -1e-3 * x_mm, 0;
    squares += (wrenchOf(estimate) - wrench).dot(covarianceOf(estimate).llt().solve(wrenchOf(estimate) - wrench));
    EXPECT_LT(covarianceOf(estimate)(2, 2), covarianceOf(alone.solve(displacement))(2, 2));
    const FoundPatch& patch = estimate.patches[0];
    EXPECT_NEAR(patch.patch.place.x_m, 1e-3 * x_mm, 4.0 * std::sqrt(patch.covariance(4, 4)));
    EXPECT_NEAR(patch.patch.place.y_m, 1e-3 * y_mm, 4.0 * std::sqrt(patch.covariance(5, 5)));
  }
  EXPECT_LT(squares / kFrames, 12.0);
  EXPECT_GT(squares / kFrames, 3.0);
}

TEST(Patches, PointsAddUpToTheForce) {
  PatchBench bench;
  const Estimate estimate = bench.solve(bench.picture(disc(6.2, -2.3, 2, kPress + 0.4 * kShear, 1.0), 4));
  ASSERT_GT(estimate.patchShare, 0.9);
  Vector3d sum = Vector3d::Zero();
  for (int p = 0; p < bench.atoms().pointCount(); ++p) sum += forcesOf(estimate).segment<3>(3 * p);
  EXPECT_LT((sum - wrenchOf(estimate).head<3>()).norm(), 1e-9);
  Vector3d moment = Vector3d::Zero();
  for (int p = 0; p < bench.atoms().pointCount(); ++p) {
    moment += Vector3d(bench.atoms().points.col(p)).cross(forcesOf(estimate).segment<3>(3 * p));
  }
  EXPECT_LT((moment - wrenchOf(estimate).tail<3>()).head<2>().norm(), 1e-9);
}

TEST(Patches, KeepNothingFromFrameToFrame) {
  PatchBench bench;
  const VectorXd a = bench.picture(disc(1, 2, 2, kPress), 1),
                 b = bench.picture(both(disc(-6, -4, 2, kPress), disc(6, 4, 2, kPress)), 2);
  const Estimate first = bench.solve(a);
  EXPECT_EQ(bench.solve(b, {4, 5, 10, 11}).patchCount, 2);
  EXPECT_EQ(bench.solve(0.0 * a).patchCount, 0);
  const Estimate again = bench.solve(a);
  EXPECT_EQ(forcesOf(again), forcesOf(first));
  EXPECT_EQ(wrenchOf(again), wrenchOf(first));
  EXPECT_EQ(again.patchShare, first.patchShare);
}

}  // namespace
}  // namespace tractiond::solve
