#include "tests/support/seed.h"
#include "touch/critical_point_tracker.h"
#include "touch/critical_points.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace touch {
namespace {

constexpr double kNoise_N = 0.005;
constexpr double kPitch_m = 3e-3;

using Shear = std::function<Eigen::Vector2d(Eigen::Vector2d)>;  ///< at a place [mm], beside a pressure of 1

/// A grid on which balls press, each with a shear.
struct Gel {
  NodeForces nodes{
      .columns = 24, .rows = 24, .pitch_m = kPitch_m, .centre_m = {1e-3, -2e-3}, .force_N = {}, .deviation_N = {}};
  std::vector<std::array<float, 3>> force_N, deviation_N;

  Gel()
      : force_N(24 * 24)
      , deviation_N(24 * 24) {}

  Eigen::Vector2d place_mm(int node) const {
    return 1e3 * (Eigen::Vector2d(nodes.centre_m[0], nodes.centre_m[1]) +
                  kPitch_m * Eigen::Vector2d(node % 24 - 11.5, node / 24 - 11.5));
  }

  /// As the daemon's fields, pressure falls off to all sides, and noise with it.
  void press(const Eigen::Vector2d& centre_mm, double radius_mm, const Shear& shear) {
    for (int node = 0; node < 24 * 24; ++node) {
      const Eigen::Vector2d place = place_mm(node);
      const double pressure_N = 0.3 * std::exp(-(place - centre_mm).squaredNorm() / (radius_mm * radius_mm));
      if (pressure_N < 1e-3) continue;
      const Eigen::Vector2d force = pressure_N * shear(place);
      const auto i = static_cast<std::size_t>(node);
      force_N[i][0] += static_cast<float>(force.x());
      force_N[i][1] += static_cast<float>(force.y());
      force_N[i][2] += static_cast<float>(pressure_N);
      deviation_N[i].fill(static_cast<float>(kNoise_N));
    }
  }

  void addNoise(std::mt19937_64& generator) {
    std::normal_distribution<float> noise(0.0F, static_cast<float>(kNoise_N));
    for (std::size_t i = 0; i < force_N.size(); ++i) {
      if (deviation_N[i][0] == 0.0F) continue;
      for (float& each : force_N[i]) each += noise(generator);
    }
  }

  std::vector<CriticalPoint> points(double leastStrength = kLeastStrength) {
    nodes.force_N = force_N;
    nodes.deviation_N = deviation_N;
    return criticalPoints(nodes, leastStrength);
  }
};

Shear linear(const Eigen::Matrix2d& J, const Eigen::Vector2d& zero_mm) {
  return [=](const Eigen::Vector2d& place) -> Eigen::Vector2d { return J * (place - zero_mm); };
}

Eigen::Matrix2d matrix(double xx, double xy, double yx, double yy) {
  return (Eigen::Matrix2d() << xx, xy, yx, yy).finished();
}

TEST(CriticalPoints, TellsVortexSourceSinkAndSaddle) {
  struct Case {
    Eigen::Matrix2d J;
    CriticalPointKind kind;
    double angle_rad;
  };
  constexpr double kRight = std::numbers::pi / 2;
  for (const Case& each : {Case{matrix(0, -0.1, 0.1, 0), CriticalPointKind::kVortex, kRight},
                           Case{matrix(0, 0.1, -0.1, 0), CriticalPointKind::kVortex, -kRight},
                           Case{matrix(-0.05, -0.1, 0.1, -0.05), CriticalPointKind::kVortex, kRight + std::atan(0.5)},
                           Case{matrix(0.1, -0.05, 0.05, 0.1), CriticalPointKind::kSource, std::atan(0.5)},
                           Case{matrix(-0.1, 0, 0, -0.1), CriticalPointKind::kSink, 2 * kRight},
                           Case{matrix(0.1, 0, 0, -0.1), CriticalPointKind::kSaddle, 0.0}}) {
    Gel gel;
    const Eigen::Vector2d zero_mm(5.3, -8.1);
    gel.press({5.0, -7.0}, 7.0, linear(each.J, zero_mm));
    const auto points = gel.points();
    ASSERT_EQ(points.size(), 1U);
    EXPECT_EQ(points[0].kind, each.kind);
    EXPECT_EQ(points[0].index, each.kind == CriticalPointKind::kSaddle ? -1 : 1);
    EXPECT_NEAR(std::remainder(points[0].angle_rad - each.angle_rad, 4 * kRight), 0.0, 1e-3);
    EXPECT_NEAR(1e3 * points[0].position_m[0], zero_mm.x(), 1e-3);
    EXPECT_NEAR(1e3 * points[0].position_m[1], zero_mm.y(), 1e-3);
  }
}

TEST(CriticalPoints, ListsNoneWhereNoiseAloneTurns) {
  std::mt19937_64 generator(tractiond::test::seed());
  int found = 0, pruned = 0;
  for (int i = 0; i < 200; ++i) {
    Gel gel;
    gel.press({2.0, 1.0}, 9.0, [](const Eigen::Vector2d&) { return Eigen::Vector2d::Zero(); });
    gel.addNoise(generator);
    found += static_cast<int>(gel.points(0.0).size());
    pruned += static_cast<int>(gel.points().size());
  }
  EXPECT_GT(found, 1000);
  EXPECT_EQ(pruned, 0);
}

TEST(CriticalPoints, HasAZeroOnANodeOrAnEdgeOnce) {
  for (const Eigen::Vector2d& pitches :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(0.5, 0), Eigen::Vector2d(0.5, 0.5), Eigen::Vector2d(1, 0)}) {
    Gel gel;
    const Eigen::Vector2d zero = gel.place_mm(12 * 24 + 12) + 3.0 * pitches;
    gel.press(zero, 7.0, linear(matrix(0, -0.125, 0.125, 0), zero));
    EXPECT_EQ(gel.points().size(), 1U) << pitches;
  }
}

TEST(CriticalPoints, HasNoneWhereNumbersAreMissing) {
  Gel gel;
  gel.press({0.0, 0.0}, 7.0, linear(matrix(0, -0.1, 0.1, 0), {0.5, 0.2}));
  ASSERT_EQ(gel.points().size(), 1U);
  gel.force_N.pop_back();
  EXPECT_TRUE(gel.points().empty());
}

CriticalPoint pointAt(double x_mm, int index = 1) {
  CriticalPoint point;
  point.index = index;
  point.position_m[0] = 1e-3 * x_mm;
  return point;
}

/// PointIds in a sequence of frames, 10 ms apart.
struct PointBench {
  CriticalPointTracker tracker;
  Field field{1'000'000'000, true, false, {}, {}};

  std::vector<std::uint64_t> see(const std::vector<CriticalPoint>& points, int frames = 1) {
    field.time_ns += 10'000'000 * frames;
    std::vector<std::uint64_t> ids;
    for (const auto& each : tracker.update(field, points, 0.1)) ids.push_back(each.id);
    return ids;
  }
};

using PointIds = std::vector<std::uint64_t>;

TEST(CriticalPointTracker, KeepsTheIdOfAPointThatMovesOrIsLostForAMoment) {
  PointBench bench;
  EXPECT_EQ(bench.see({pointAt(0), pointAt(10)}), (PointIds{1, 2}));
  EXPECT_EQ(bench.see({pointAt(12), pointAt(3)}), (PointIds{1, 2})) << "whatever their order";
  EXPECT_EQ(bench.see({}, 5), PointIds{});
  bench.field.valid = false;
  EXPECT_EQ(bench.see({pointAt(3)}), PointIds{}) << "a field that is not valid says nothing";
  bench.field.valid = true;
  EXPECT_EQ(bench.see({pointAt(4)}), PointIds{1});
  EXPECT_EQ(bench.see({pointAt(4)}, 11), PointIds{3}) << "after more than 0.1 s";
}

TEST(CriticalPointTracker, BeginsAnewWhatIsAnotherPoint) {
  PointBench bench;
  EXPECT_EQ(bench.see({pointAt(0)}), PointIds{1});
  EXPECT_EQ(bench.see({pointAt(0, -1)}), PointIds{2}) << "of another index";
  EXPECT_EQ(bench.see({pointAt(7, -1)}), PointIds{3}) << "too far";
  bench.field.basis.zero[0] = 1;
  EXPECT_EQ(bench.see({pointAt(7, -1)}), PointIds{4}) << "after a zero";
  bench.field.time_ns -= 1'000'000'000;
  EXPECT_EQ(bench.see({pointAt(7, -1)}), PointIds{5}) << "time went back";
}

}  // namespace
}  // namespace touch
