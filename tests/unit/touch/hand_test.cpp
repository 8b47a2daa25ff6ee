#include "tests/support/seed.h"
#include "touch/hand.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <vector>

namespace touch::hand_test {
namespace {

using Eigen::Vector3d;
using Vector6 = Wrench::Vector6;
using Matrix6 = Wrench::Matrix6;
using Chance = std::mt19937;

constexpr std::int64_t kFrame_ns = 16'666'667;

template <typename Result>
Result drawn(Chance& chance, double deviation = 1.0) {
  std::normal_distribution<double> normal(0.0, deviation);
  return Result::NullaryExpr([&] { return normal(chance); });
}

Pose randomPose(Chance& chance) {
  const auto axis = drawn<Vector3d>(chance);
  return {Eigen::AngleAxisd(axis.norm(), axis.normalized()).toRotationMatrix(), drawn<Vector3d>(chance, 0.05)};
}

/// A hand whose frames are given by hand.
struct Bench {
  explicit Bench(const std::vector<Pose>& poses)
      : hand(poses)
      , frames(poses.size()) {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      frames[i].sensor = std::string(1, static_cast<char>('a' + i));
      frames[i].boot[0] = frames[i].calibration[0] = static_cast<std::uint8_t>(i + 1);
      frames[i].captured_ns = 1'000'000'000;
      frames[i].error_ns = 100'000;
      frames[i].bound = CaptureBound::kBoth;
      frames[i].valid = true;
    }
  }

  /// The next frame of a finger.
  const Grasp* take(std::size_t finger) {
    frames[finger].captured_ns += kFrame_ns;
    ++frames[finger].number;
    now_ns = frames[finger].captured_ns + 5'000'000;
    return hand.take(finger, frames[finger], now_ns);
  }
  /// The next frame of each.
  const Grasp* takeAll() {
    const Grasp* last = nullptr;
    for (std::size_t i = 0; i < frames.size(); ++i) last = take(i);
    return last;
  }
  /// Frames until intervals are known.
  const Grasp* begin() {
    takeAll();
    return takeAll();
  }

  Hand hand;
  std::vector<FingerFrame> frames;
  std::int64_t now_ns = 0;
};

FingerState stateAfterSilence(Bench& bench, std::size_t finger) {
  return bench.hand.wait(bench.now_ns).fingers[finger].state;
}

TEST(Hand, FingersThatHoldABodyBearItsWeightAndMoment) {
  Chance chance(tractiond::test::seed() + 1);
  for (int grip = 0; grip < 20; ++grip) {
    const std::vector<Pose> poses = {randomPose(chance), randomPose(chance), randomPose(chance)};
    const Vector3d weight(0.0, 0.0, -0.6), centre = drawn<Vector3d>(chance, 0.03);
    // Points at which the fingers touch it. All forces but those at three points are anything; those three balance
    // them.
    Bench bench(poses);
    Vector3d force = -weight, moment = -centre.cross(weight);  // that of the hand on the body
    Eigen::Matrix<double, 6, 9> last;
    std::vector<std::pair<std::size_t, Vector3d>> points;  // of a gel
    for (std::size_t finger = 0; finger < poses.size(); ++finger) {
      for (int i = 0; i < 4; ++i) points.emplace_back(finger, drawn<Vector3d>(chance, 0.01));
    }
    const auto placed = [&](std::size_t i) {
      const auto& [finger, point] = points[i];
      return Vector3d(poses[finger].rotation * point + poses[finger].position_m);
    };
    std::vector<Vector3d> forces(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (i % 4 == 0) {
        const auto column = static_cast<Eigen::Index>(3 * (i / 4));
        for (Eigen::Index axis = 0; axis < 3; ++axis) {
          last.col(column + axis) << Vector3d::Unit(axis), placed(i).cross(Vector3d::Unit(axis));
        }
        continue;
      }
      forces[i] = drawn<Vector3d>(chance);
      force -= forces[i];
      moment -= placed(i).cross(forces[i]);
    }
    Vector6 rest;
    rest << force, moment;
    const Eigen::Matrix<double, 9, 1> balancing = last.completeOrthogonalDecomposition().solve(rest);
    for (std::size_t i = 0; i < points.size(); i += 4)
      forces[i] = balancing.segment<3>(3 * static_cast<Eigen::Index>(i / 4));
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& [finger, point] = points[i];
      const Vector3d onGel = -poses[finger].rotation.transpose() * forces[i];
      bench.frames[finger].wrench.value.head<3>() += onGel;
      bench.frames[finger].wrench.value.tail<3>() += point.cross(onGel);
    }
    const Grasp* grasp = bench.begin();
    ASSERT_NE(grasp, nullptr);
    ASSERT_TRUE(grasp->valid);
    EXPECT_LT((grasp->wrench.value.head<3>() - weight).norm(), 1e-12);
    EXPECT_LT((grasp->wrench.value.tail<3>() - centre.cross(weight)).norm(), 1e-12);
    Vector6 sum = Vector6::Zero();
    for (const Grasp::Finger& finger : grasp->fingers) sum += finger.frame.wrench.value;
    EXPECT_LT((sum - grasp->wrench.value).norm(), 1e-12);
  }
}

TEST(Hand, NoiseOfTheWrenchIsWhatManyFramesScatterBy) {
  Chance chance(tractiond::test::seed() + 2);
  const std::vector<Pose> poses = {randomPose(chance), randomPose(chance)};
  Bench bench(poses);
  std::vector<Matrix6> roots;
  for (FingerFrame& frame : bench.frames) {
    roots.push_back(drawn<Matrix6>(chance, 0.1));
    frame.wrench.noise = roots.back() * roots.back().transpose();
  }
  Matrix6 stated = Matrix6::Zero(), scatter = Matrix6::Zero();
  constexpr int kFrames = 20'000;
  for (int i = 0; i < kFrames; ++i) {
    for (std::size_t finger = 0; finger < poses.size(); ++finger)
      bench.frames[finger].wrench.value = roots[finger] * drawn<Vector6>(chance);
    const Grasp* grasp = bench.takeAll();
    if (grasp == nullptr) continue;  // the first
    stated = grasp->wrench.noise;
    scatter += grasp->wrench.value * grasp->wrench.value.transpose() / (kFrames - 1);
  }
  const Vector6 scale = stated.diagonal().cwiseSqrt();
  EXPECT_LT((scatter - stated).cwiseQuotient(scale * scale.transpose()).cwiseAbs().maxCoeff(), 0.05);
}

TEST(Hand, SystematicErrorsOfOneGelFileMayBeTheSameInBothFingers) {
  Chance chance(tractiond::test::seed() + 3);
  const std::vector<Pose> poses = {randomPose(chance), randomPose(chance)};
  for (const bool oneFile : {true, false}) {
    Bench bench(poses);
    if (oneFile) bench.frames[1].calibration = bench.frames[0].calibration;
    std::vector<Matrix6> roots, toHand;
    for (std::size_t finger = 0; finger < poses.size(); ++finger) {
      roots.push_back(drawn<Matrix6>(chance, 0.1));
      bench.frames[finger].wrench.systematic = roots.back() * roots.back().transpose();
    }
    const Grasp* grasp = bench.begin();
    ASSERT_NE(grasp, nullptr);
    std::vector<Matrix6> parts;
    for (std::size_t finger = 0; finger < poses.size(); ++finger) {
      const Matrix6& part = grasp->fingers[finger].frame.wrench.systematic;
      parts.push_back(part.llt().matrixL());
    }
    for (int mix = 0; mix < 20; ++mix) {  // errors that one draw causes in both, in any way
      const Matrix6 turn = drawn<Matrix6>(chance).householderQr().householderQ();
      const Matrix6 both = parts[0] + parts[1] * turn,
                    apart = parts[0] * parts[0].transpose() + parts[1] * parts[1].transpose();
      const Matrix6 caused = oneFile ? Matrix6(both * both.transpose()) : apart;
      const Matrix6 surplus = grasp->wrench.systematic - caused;
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(surplus).eigenvalues().minCoeff(), -1e-12);
    }
  }
}

TEST(Hand, FramesOfOneMomentAreMatchedOnceThroughJitterLossesAndDelays) {
  Chance chance(tractiond::test::seed() + 4);
  std::uniform_real_distribution<double> uniform;
  const std::vector<Pose> poses(3);
  Bench bench(poses);
  struct Arrival {
    double at_ns;
    std::size_t finger;
    FingerFrame frame;
  };
  std::vector<Arrival> arrivals;
  std::vector<int> captured(2000);
  std::vector<double> arrived_ns(poses.size());
  for (std::size_t moment = 0; moment < captured.size(); ++moment) {
    for (std::size_t finger = 0; finger < poses.size(); ++finger) {
      FingerFrame frame = bench.frames[finger];
      frame.number = moment + 1;
      frame.captured_ns += static_cast<std::int64_t>(moment) * kFrame_ns + std::int64_t(6e6 * (uniform(chance) - 0.5));
      const double delay_ns = 5e6 + 40e6 * uniform(chance) * uniform(chance);
      if (uniform(chance) < 0.1) continue;
      ++captured[moment];
      arrived_ns[finger] = std::max(arrived_ns[finger] + 1.0, static_cast<double>(frame.captured_ns) + delay_ns);
      arrivals.push_back({arrived_ns[finger], finger, frame});
    }
  }
  std::ranges::sort(arrivals, {}, &Arrival::at_ns);
  std::uint64_t last = 0;
  int sets = 0;
  for (const Arrival& each : arrivals) {
    const Grasp* grasp = bench.hand.take(each.finger, each.frame, static_cast<std::int64_t>(each.at_ns));
    if (grasp == nullptr) continue;
    ++sets;
    std::set<std::uint64_t> moments;
    for (const Grasp::Finger& finger : grasp->fingers) moments.insert(finger.frame.number);
    ASSERT_EQ(moments.size(), 1U);
    EXPECT_GT(*moments.begin(), last);
    last = *moments.begin();
    for (const Grasp::Finger& finger : grasp->fingers) {
      EXPECT_LE(grasp->earliest_ns, finger.frame.captured_ns - finger.frame.error_ns);
      EXPECT_GE(grasp->latest_ns, finger.frame.captured_ns + finger.frame.error_ns);
    }
  }
  EXPECT_GE(sets, std::ranges::count(captured, 3) - 3) << "but before the intervals are known";
}

TEST(Hand, CamerasThatRunFreelyHaveASetForEachFrame) {
  Bench bench(std::vector<Pose>(3));
  for (std::size_t finger = 0; finger < 3; ++finger)
    bench.frames[finger].captured_ns += static_cast<std::int64_t>(finger) * kFrame_ns / 3;
  int sets = 0;
  for (int frame = 0; frame < 100; ++frame) {
    for (std::size_t finger = 0; finger < 3; ++finger) {
      const Grasp* grasp = bench.take(finger);
      if (grasp == nullptr) continue;
      ++sets;
      EXPECT_LT(grasp->latest_ns - grasp->earliest_ns, kFrame_ns);
    }
  }
  EXPECT_GE(sets, 97);
}

TEST(Hand, AFingerThatStopsIsNamedAndNothingIsMadeOfTheOthers) {
  Bench bench(std::vector<Pose>(2));
  bench.frames[0].wrench.value << 1.0, 2.0, 3.0, 4.0, 5.0, 6.0;
  ASSERT_NE(bench.begin(), nullptr);
  for (int frame = 0; frame < 30; ++frame) ASSERT_EQ(bench.take(0), nullptr);
  const Grasp& grasp = bench.hand.wait(bench.now_ns);
  EXPECT_FALSE(grasp.valid);
  EXPECT_TRUE(grasp.wrench.value.isZero());
  EXPECT_TRUE(grasp.fingers[0].frame.wrench.value.isZero());
  EXPECT_EQ(grasp.fingers[0].state, FingerState::kUnmatched);
  EXPECT_EQ(grasp.fingers[1].state, FingerState::kMissing);

  bench.frames[1].captured_ns = bench.frames[0].captured_ns;
  bench.frames[1].number = bench.frames[0].number;
  const Grasp* again = bench.takeAll();
  ASSERT_NE(again, nullptr);
  EXPECT_TRUE(again->valid);
  EXPECT_EQ(again->fingers[0].frame.captured_ns, again->fingers[1].frame.captured_ns);
}

TEST(Hand, AFieldThatIsNotValidMakesTheGraspInvalid) {
  Bench bench(std::vector<Pose>(2));
  ASSERT_TRUE(bench.begin()->valid);
  bench.frames[0].wrench.value.setOnes();
  for (const double bad : {0.0, std::nan("")}) {
    bench.frames[1].valid = bad != 0.0;
    bench.frames[1].wrench.noise(2, 3) = bad;
    const Grasp* grasp = bench.takeAll();
    ASSERT_NE(grasp, nullptr);
    EXPECT_FALSE(grasp->valid);
    EXPECT_TRUE(grasp->wrench.value.isZero());
    EXPECT_EQ(grasp->fingers[0].state, FingerState::kMatched);
    EXPECT_EQ(grasp->fingers[0].frame.wrench.value[0], 1.0);
    EXPECT_EQ(grasp->fingers[1].state, FingerState::kNotValid);
  }
}

TEST(Hand, AClockWithoutABoundMatchesNothing) {
  Bench bench(std::vector<Pose>(2));
  bench.begin();
  bench.frames[1].bound = CaptureBound::kNone;
  EXPECT_EQ(bench.takeAll(), nullptr);
  EXPECT_EQ(stateAfterSilence(bench, 0), FingerState::kUnmatched);
  EXPECT_EQ(stateAfterSilence(bench, 1), FingerState::kUndated);
  bench.frames[1].bound = CaptureBound::kLatest;
  EXPECT_NE(bench.takeAll(), nullptr);
  bench.frames[1].error_ns = 2'000'000'000;  // as good as none
  EXPECT_EQ(bench.takeAll(), nullptr);
  EXPECT_EQ(stateAfterSilence(bench, 1), FingerState::kUndated);
}

TEST(Hand, TwoDaemonsWithOneNameMakeAFingerAmbiguousAndARestartDoesNot) {
  Bench bench(std::vector<Pose>(2));
  bench.begin();
  bench.frames[1].boot[0] = 77;  // a restart
  bench.frames[1].number = 0;
  bench.takeAll();
  EXPECT_NE(bench.takeAll(), nullptr);
  for (const std::uint8_t boot : std::array<std::uint8_t, 3>{2, 77, 2}) {
    bench.frames[1].boot[0] = boot;
    bench.takeAll();
  }
  EXPECT_EQ(bench.takeAll(), nullptr);
  EXPECT_EQ(stateAfterSilence(bench, 1), FingerState::kAmbiguous);
  for (int frame = 0; frame < 65; ++frame) bench.takeAll();
  EXPECT_NE(bench.takeAll(), nullptr) << "a second after the other one is gone";

  bench.frames[1].sensor = bench.frames[0].sensor;
  EXPECT_EQ(bench.takeAll(), nullptr);
  for (const std::size_t finger : {0, 1}) EXPECT_EQ(stateAfterSilence(bench, finger), FingerState::kAmbiguous);
}

}  // namespace
}  // namespace touch::hand_test
