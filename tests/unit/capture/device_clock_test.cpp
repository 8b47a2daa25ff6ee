#include "daemon/capture/device_clock.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

namespace tractiond::capture::device_clock_test {
namespace {

constexpr std::int64_t kPeriod_ns = 16'666'667;
constexpr std::int64_t kShortestDelay_ns = 300'000;

/// A camera whose clock runs at its own rate, and frames that are delayed at random but never hastened.
class Rig {
 public:
  explicit Rig(double drift, double meanDelay_ns = 200'000)
      : drift_(drift)
      , delay_(1.0 / meanDelay_ns) {}

  DeviceClock::Moment frame(DeviceClock& clock) {
    taken_ns_ += kPeriod_ns;
    const std::int64_t host_ns = taken_ns_ + kShortestDelay_ns + static_cast<std::int64_t>(delay_(random_));
    return clock.add(device(), host_ns);
  }
  std::int64_t device() const {
    return step_ns_ + static_cast<std::int64_t>(static_cast<double>(taken_ns_) * (1.0 - drift_));
  }
  std::int64_t taken() const { return taken_ns_; }  ///< when the last frame was taken, on the host's clock
  void step(std::int64_t step_ns) { step_ns_ += step_ns; }

 private:
  double drift_;
  std::mt19937 random_{1};
  std::exponential_distribution<double> delay_;
  std::int64_t taken_ns_ = 5'000'000'000;
  std::int64_t step_ns_ = 123'456'789'000'000;
};

TEST(DeviceClock, FindsDriftAndOffset) {
  for (const double drift : {0.0, 40e-6, -90e-6, 400e-6}) {
    DeviceClock clock;
    Rig rig(drift);
    DeviceClock::Moment moment;
    for (int i = 0; i < 60 * 60; ++i) moment = rig.frame(clock);
    EXPECT_NEAR(clock.drift(), drift, 2e-6);
    // Late by the shortest delay, which cannot be seen, and within its own error of that.
    EXPECT_LE(std::abs(moment.captured_ns - rig.taken() - kShortestDelay_ns), moment.error_ns) << drift;
    EXPECT_LT(moment.error_ns, 50'000);
  }
}

TEST(DeviceClock, ItsErrorHoldsFromTheFirstFrameOn) {
  for (const double drift : {0.0, 100e-6, -100e-6}) {
    DeviceClock clock;
    Rig rig(drift, 1'000);
    for (int i = 0; i < 60 * 40; ++i) {
      const DeviceClock::Moment moment = rig.frame(clock);
      const std::int64_t off_ns = moment.captured_ns - rig.taken() - kShortestDelay_ns;
      ASSERT_LE(std::abs(off_ns), moment.error_ns + 5'000) << drift << ", frame " << i;
    }
  }
}

/// The frames of three windows that came soonest lie close together in time, and so show little of the drift.
TEST(DeviceClock, ItsErrorHoldsUntilTheDriftIsKnown) {
  constexpr double kDrift = 400e-6;
  constexpr std::int64_t kFrame_ns = 100'000'000, kLate_ns = 5'000'000;
  DeviceClock clock;
  for (int i = 0; i < 40; ++i) {
    const std::int64_t taken_ns = i * kFrame_ns;
    const bool isSoon = i == 9 || i == 10 || i >= 20;
    const auto device_ns = static_cast<std::int64_t>(static_cast<double>(taken_ns) * (1 - kDrift));
    const DeviceClock::Moment moment = clock.add(device_ns, taken_ns + (isSoon ? 0 : kLate_ns));
    if (i < 9) continue;
    EXPECT_LE(std::abs(moment.captured_ns - taken_ns), moment.error_ns) << i;
  }
}

/// Others than the first frame, which waited while the camera was opened, lead it by what that waited.
TEST(DeviceClock, ALateFirstFrameCostsNoPrecision) {
  constexpr std::int64_t kLate_ns = 5'000'000;
  DeviceClock clock;
  DeviceClock::Moment moment;
  for (std::int64_t taken_ns = 0; taken_ns < 6'000'000'000; taken_ns += kPeriod_ns) {
    moment = clock.add(taken_ns, taken_ns + (taken_ns == 0 ? kLate_ns : 0));
  }
  EXPECT_LT(moment.error_ns, 50'000);
}

TEST(DeviceClock, OwnsUpToASmallStepUntilItHasForgottenIt) {
  for (const std::int64_t step_ns : {std::int64_t{5'000'000}, std::int64_t{-5'000'000}}) {
    DeviceClock clock;
    Rig rig(20e-6, 20'000);
    for (int i = 0; i < 60 * 30; ++i) rig.frame(clock);
    rig.step(step_ns);
    DeviceClock::Moment moment;
    for (int i = 0; i < 60 * 2; ++i) moment = rig.frame(clock);
    EXPECT_LE(std::abs(moment.captured_ns - rig.taken() - kShortestDelay_ns), moment.error_ns);
    for (int i = 0; i < 60 * 30; ++i) moment = rig.frame(clock);
    EXPECT_LE(std::abs(moment.captured_ns - rig.taken() - kShortestDelay_ns), moment.error_ns);
    EXPECT_LT(moment.error_ns, 50'000);
  }
}

// ---------------------------------------------------------------- which clock

/// What the gate would say of a frame.
Judgement newFrame(bool timed, bool newTimeline, std::uint64_t step = 1) {
  Judgement judgement;
  judgement.verdict = Verdict::kNew;
  judgement.timed = timed;
  judgement.newTimeline = newTimeline;
  judgement.step = step;
  return judgement;
}

TEST(CaptureClock, NeverGoesBackNorAheadOfTheArrivalWhateverTheCamerasClockDoes) {
  std::mt19937 random(3);
  CaptureClock clock;
  Arrival arrival;
  arrival.host_ns = 1'000'000'000;
  std::int64_t last_ns = INT64_MIN;
  for (int i = 0; i < 20'000; ++i) {
    if (random() % 50 == 0) arrival.device_ns += static_cast<std::int64_t>(random() % 2'000'000'000) - 1'000'000'000;
    arrival.device_ns += kPeriod_ns;
    arrival.host_ns += static_cast<std::int64_t>(random() % 30'000'000);
    const auto moment = clock.add(arrival, newFrame(random() % 5 != 0, i == 0 || random() % 500 == 0), true);
    ASSERT_GE(moment.captured_ns, last_ns);
    ASSERT_LE(moment.captured_ns, arrival.host_ns);
    ASSERT_GT(moment.error_ns, 0);
    last_ns = moment.captured_ns;
  }
}

TEST(CaptureClock, OwnsUpToFramesThatWaitedInAQueue) {
  CaptureClock clock;
  std::int64_t taken_ns = 5'000'000'000;
  const auto frame = [&](std::int64_t host_ns, bool awaited) {
    Arrival arrival;
    arrival.host_ns = host_ns;
    return clock.add(arrival, newFrame(false, false), awaited);
  };
  for (int i = 0; i < 100; ++i) frame((taken_ns += kPeriod_ns) + kShortestDelay_ns, true);
  // The host stands still for half a second, and finds ten pictures.
  const std::int64_t back_ns = taken_ns + 500'000'000;
  for (int i = 0; i < 10; ++i) {
    taken_ns += kPeriod_ns;
    const auto moment = frame(back_ns + i * 1000, false);
    EXPECT_LE(moment.captured_ns - taken_ns - kShortestDelay_ns, moment.error_ns) << i;
  }
}

TEST(CaptureClock, ACoarseCameraClockIsWorthItsResolution) {
  std::mt19937 random(1);
  for (const std::int64_t resolution_ns :
       {std::int64_t{1'000'000}, std::int64_t{4'000'000}, std::int64_t{10'000'000}}) {
    CaptureClock clock;
    std::exponential_distribution<double> delay(1.0 / 200'000);
    std::int64_t taken_ns = 5'000'000'000;
    for (int i = 0; i < 2000; ++i) {
      taken_ns += kPeriod_ns;
      Arrival arrival;
      arrival.device_ns = taken_ns - taken_ns % resolution_ns;
      arrival.host_ns = taken_ns + kShortestDelay_ns + static_cast<std::int64_t>(delay(random));
      const auto moment = clock.add(arrival, newFrame(true, i == 0), true);
      if (i > 100) {
        ASSERT_LE(std::abs(moment.captured_ns - taken_ns - kShortestDelay_ns), moment.error_ns) << resolution_ns;
      }
    }
  }
}

TEST(CaptureClock, FirstFramesOfATimelineDoNotKnowTheShortestDelay) {
  constexpr std::int64_t kJitter_ns = 2'000'000, kSet_ns = 3'600'000'000'000;
  std::mt19937 random(1);
  CaptureClock clock;
  int missed = 0;
  std::int64_t taken_ns = 5'000'000'000;
  for (int timeline = 0; timeline < 50; ++timeline) {
    for (int i = 0; i < 100; ++i) {
      taken_ns += kPeriod_ns;
      Arrival arrival;
      arrival.device_ns = taken_ns - timeline * kSet_ns;
      arrival.host_ns = taken_ns + kShortestDelay_ns + static_cast<std::int64_t>(random() % kJitter_ns);
      const auto moment = clock.add(arrival, newFrame(true, i == 0), true);
      missed += std::abs(moment.captured_ns - taken_ns - kShortestDelay_ns) > moment.error_ns ? 1 : 0;
      if (i == 99) {
        EXPECT_LT(moment.error_ns, 2 * kJitter_ns);
      }
    }
  }
  EXPECT_LE(missed, 50) << "of 5000";
}

}  // namespace
}  // namespace tractiond::capture::device_clock_test
