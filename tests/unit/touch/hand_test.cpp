#include "tests/support/seed.h"
#include "touch/hand.h"

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
      frames[i].header.sensor = std::string(1, static_cast<char>('a' + i));
      frames[i].header.boot[0] = frames[i].header.calibration[0] = static_cast<std::uint8_t>(i + 1);
      frames[i].header.captured_ns = 1'000'000'000;
      frames[i].header.capturedError_ns = 100'000;
      frames[i].header.capturedBound = CaptureBound::kBoth;
      frames[i].valid = true;
    }
  }

  /// The next frame of a finger.
  const Grasp* take(std::size_t finger) {
    frames[finger].header.captured_ns += kFrame_ns;
    ++frames[finger].header.frameNumber;
    now_ns = frames[finger].header.captured_ns + 5'000'000;
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

/// Returns what a force and a moment about the gel's origin are in the hand.
Vector6 inHand(const Pose& pose, const Vector6& wrench) {
  const Vector3d force = pose.rotation * wrench.head<3>();
  Vector6 turned;
  turned << force, pose.rotation * wrench.tail<3>() + pose.position_m.cross(force);
  return turned;
}

TEST(Hand, WrenchIsTheSumOfTheFingersAboutTheOriginOfTheHandWithItsCovariance) {
  Chance chance(tractiond::test::seed() + 1);
  for (const bool oneFile : {true, false}) {
    const std::vector<Pose> poses = {randomPose(chance), randomPose(chance), randomPose(chance)};
    Bench bench(poses);
    Vector6 value = Vector6::Zero();
    Matrix6 noise = Matrix6::Zero(), systematic = Matrix6::Zero();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      Wrench& wrench = bench.frames[i].wrench;
      wrench.value = drawn<Vector6>(chance);
      value += inHand(poses[i], wrench.value);
      const auto root = drawn<Matrix6>(chance);
      wrench.noise = root * root.transpose();
      wrench.systematic = 2.0 * wrench.noise;
      // Errors of one gel file may be the same in all three: (a + b + c)^2 is at most three times the squares.
      if (oneFile) bench.frames[i].header.calibration = bench.frames[0].header.calibration;
      for (const Vector6& error : root.colwise()) {
        const Vector6 turned = inHand(poses[i], error);
        noise += turned * turned.transpose();
        systematic += (oneFile ? 6.0 : 2.0) * turned * turned.transpose();
      }
    }
    const Grasp* grasp = bench.begin();
    ASSERT_NE(grasp, nullptr);
    ASSERT_TRUE(grasp->valid);
    EXPECT_LT((grasp->wrench.value - value).norm(), 1e-12);
    EXPECT_LT((grasp->wrench.noise - noise).norm(), 1e-12 * noise.norm());
    EXPECT_LT((grasp->wrench.systematic - systematic).norm(), 1e-12 * systematic.norm());
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
      frame.header.frameNumber = moment + 1;
      frame.header.captured_ns +=
          static_cast<std::int64_t>(moment) * kFrame_ns + std::int64_t(6e6 * (uniform(chance) - 0.5));
      const double delay_ns = 5e6 + 40e6 * uniform(chance) * uniform(chance);
      if (uniform(chance) < 0.1) continue;
      ++captured[moment];
      arrived_ns[finger] = std::max(arrived_ns[finger] + 1.0, static_cast<double>(frame.header.captured_ns) + delay_ns);
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
    for (const Grasp::Finger& finger : grasp->fingers) moments.insert(finger.frame.header.frameNumber);
    ASSERT_EQ(moments.size(), 1U);
    EXPECT_GT(*moments.begin(), last);
    last = *moments.begin();
    for (const Grasp::Finger& finger : grasp->fingers) {
      EXPECT_LE(grasp->earliest_ns, finger.frame.header.captured_ns - finger.frame.header.capturedError_ns);
      EXPECT_GE(grasp->latest_ns, finger.frame.header.captured_ns + finger.frame.header.capturedError_ns);
    }
  }
  EXPECT_GE(sets, std::ranges::count(captured, 3) - 3) << "but before the intervals are known";
}

TEST(Hand, CamerasThatRunFreelyHaveASetForEachFrame) {
  Bench bench(std::vector<Pose>(3));
  for (std::size_t finger = 0; finger < 3; ++finger)
    bench.frames[finger].header.captured_ns += static_cast<std::int64_t>(finger) * kFrame_ns / 3;
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

  bench.frames[1].header.captured_ns = bench.frames[0].header.captured_ns;
  bench.frames[1].header.frameNumber = bench.frames[0].header.frameNumber;
  const Grasp* again = bench.takeAll();
  ASSERT_NE(again, nullptr);
  EXPECT_TRUE(again->valid);
  EXPECT_EQ(again->fingers[0].frame.header.captured_ns, again->fingers[1].frame.header.captured_ns);
}

TEST(Hand, AFingerOfASlowCameraIsNotMissingBetweenItsFrames) {
  Bench bench({Pose{}, Pose{}});
  for (int frame = 0; frame < 4; ++frame) {
    for (FingerFrame& each : bench.frames) each.header.captured_ns += 100'000'000 - kFrame_ns;
    bench.takeAll();
  }
  EXPECT_EQ(bench.hand.silence_ns(), 300'000'000);
  bench.now_ns += 250'000'000;
  EXPECT_EQ(stateAfterSilence(bench, 0), FingerState::kUnmatched);
  bench.now_ns += 100'000'000;
  EXPECT_EQ(stateAfterSilence(bench, 0), FingerState::kMissing);
}

TEST(Hand, AFieldThatIsNotValidMakesTheGraspInvalid) {
  Bench bench(std::vector<Pose>(2));
  ASSERT_TRUE(bench.begin()->valid);
  bench.frames[0].wrench.value.setOnes();
  bench.frames[1].valid = false;
  const Grasp* grasp = bench.takeAll();
  ASSERT_NE(grasp, nullptr);
  EXPECT_FALSE(grasp->valid);
  EXPECT_TRUE(grasp->wrench.value.isZero());
  EXPECT_EQ(grasp->fingers[0].state, FingerState::kMatched);
  EXPECT_EQ(grasp->fingers[0].frame.wrench.value[0], 1.0);
  EXPECT_EQ(grasp->fingers[1].state, FingerState::kNotValid);
}

TEST(Hand, AClockWithoutABoundMatchesNothing) {
  Bench bench(std::vector<Pose>(2));
  bench.begin();
  bench.frames[1].header.capturedBound = CaptureBound::kNone;
  EXPECT_EQ(bench.takeAll(), nullptr);
  EXPECT_EQ(stateAfterSilence(bench, 0), FingerState::kUnmatched);
  EXPECT_EQ(stateAfterSilence(bench, 1), FingerState::kUndated);
  bench.frames[1].header.capturedBound = CaptureBound::kLatest;
  EXPECT_NE(bench.takeAll(), nullptr);
  bench.frames[1].header.capturedError_ns = 2'000'000'000;  // as good as none
  EXPECT_EQ(bench.takeAll(), nullptr);
  EXPECT_EQ(stateAfterSilence(bench, 1), FingerState::kUndated);
}

TEST(Hand, TwoDaemonsWithOneNameMakeAFingerAmbiguousAndARestartDoesNot) {
  Bench bench(std::vector<Pose>(2));
  bench.begin();
  bench.frames[1].header.boot[0] = 77;  // a restart
  bench.frames[1].header.frameNumber = 0;
  bench.takeAll();
  EXPECT_NE(bench.takeAll(), nullptr);
  for (const std::uint8_t boot : std::array<std::uint8_t, 3>{2, 77, 2}) {
    bench.frames[1].header.boot[0] = boot;
    bench.takeAll();
  }
  EXPECT_EQ(bench.takeAll(), nullptr);
  EXPECT_EQ(stateAfterSilence(bench, 1), FingerState::kAmbiguous);
  for (int frame = 0; frame < 65; ++frame) bench.takeAll();
  EXPECT_NE(bench.takeAll(), nullptr) << "a second after the other one is gone";

  bench.frames[1].header.sensor = bench.frames[0].header.sensor;
  EXPECT_EQ(bench.takeAll(), nullptr);
  for (const std::size_t finger : {0, 1}) EXPECT_EQ(stateAfterSilence(bench, finger), FingerState::kAmbiguous);
}

}  // namespace
}  // namespace touch::hand_test
