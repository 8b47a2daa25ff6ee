// Random sequences of requests, frames, silences, drops and slow disks: each request gets one answer in time, and no
// zero is taken that nobody waits for.
#include "tests/support/seed.h"
#include "tests/unit/control/procedures_bench.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <deque>
#include <random>

namespace tractiond::control::procedures_random_test {
namespace {

using Kind = CalibrationStep::Kind;

constexpr double kTurn_s = 0.2;  // the longest

/// What people do to the daemon for some minutes, with the control server's manners: who asks for a zero while one is
/// asked for shares its answer, who asks for a step while one runs ends that one.
class Day {
 public:
  explicit Day(unsigned seed)
      : generator_(seed)
      , bench_(uniform(2, 60), coarse()) {
    bench_.onDescribed = [this](const RestPose& pose) { expectAsked(pose); };
  }

  void run() {
    if (chance(0.5)) bench_.procedures.welcome("Camera-1", chance(0.5) ? 60.0 : 0.0, std::nullopt);
    turn();  // the daemon has said how long a zero may take
    while (now_s() < 400.0) {
      if (now_s() >= weather_until_s_) drawWeather();
      if (chance(0.01)) askForZero();
      if (chance(0.01)) askForStep();
      turn();
    }
    bench_.diskHangs = false;
    for (double end_s = now_s() + 200.0; now_s() < end_s;) turn();  // whoever still waits is answered
    EXPECT_FALSE(zeroAsked_s_);
    EXPECT_FALSE(stepAsked_s_);
    EXPECT_EQ(bench_.zeroAnswers.size(), zeros_);
    EXPECT_EQ(bench_.stepAnswers.size() + replaced_, steps_);
  }

  std::size_t zeros() const { return zeros_; }
  std::size_t steps() const { return steps_; }
  std::size_t taken() const { return taken_; }

 private:
  static sensor::Sensor coarse() {
    sensor::Sensor sensor;
    for (sensor::MarkerLayer& layer : sensor.layers) {
      layer.columns = layer.rows = 6;
      layer.pitch = 12e-3;
    }
    return sensor;
  }

  double uniform(double low, double high) { return std::uniform_real_distribution(low, high)(generator_); }
  int uniform(int low, int high) { return std::uniform_int_distribution(low, high)(generator_); }
  bool chance(double p) { return std::bernoulli_distribution(p)(generator_); }
  double now_s() const { return 1e-9 * static_cast<double>(ProceduresBench::now_ns); }

  void drawWeather() {
    const double rates[] = {0.0, 0.3, 5.0, 60.0, 60.0};
    rate_Hz_ = rates[uniform(0, 4)];
    few_ = chance(0.2);
    moves_ = chance(0.2);
    bench_.keepFails = chance(0.1);
    bench_.diskHangs = chance(0.3);
    diskTakes_s_ = uniform(0.0, chance(0.1) ? 200.0 : 20.0);
    weather_until_s_ = now_s() + uniform(0.5, 12.0);
  }

  void askForZero() {
    if (zeroAsked_s_) return;
    ++zeros_;
    zeroAsked_s_ = now_s();
    // As the status said before.
    zeroUntil_s_ = now_s() + bench_.zeroWithin_s() + 2 * kTurn_s;  // to see that it is over, and to take the pose
    bench_.procedures.zero().begin({});
    checkAnswers();
  }

  void askForStep() {
    ++steps_;
    if (stepAsked_s_) ++replaced_;
    CalibrationStep step;
    step.kind = static_cast<Kind>(uniform(0, 3));
    step.seconds = uniform(0.1, 20.0);
    step.weight_N = 1.0;
    stepAsked_s_ = now_s();
    stepUntil_s_ = now_s() + step.seconds + calibrate::CalibrationOptions{}.grace_s +
                   2.0 * (1e-9 * static_cast<double>(ZeroProcedure::kNoFrames_ns) + kTurn_s) + kTurn_s;
    bench_.procedures.beginStep(step);
    checkAnswers();
  }

  /// The frames of a turn, what the tracker makes of them, and what the procedures make of that.
  void turn() {
    const double turn_s = uniform(0.003, kTurn_s);
    bench_.pass(static_cast<std::int64_t>(1e3 * turn_s));
    for (due_ += turn_s * rate_Hz_; due_ >= 1.0; due_ -= 1.0) frame();
    while (!bench_.disk.empty() && (!bench_.diskHangs || chance(turn_s / diskTakes_s_))) bench_.writeOne();
    bench_.turn();
    // A turn may come between the tracker's word that a zero is taken and the pose, in the middle of its frame.
    if (late_) bench_.tracker.finished = std::exchange(late_, std::nullopt);
    checkAnswers();
  }

  void frame() {
    using track::ZeroState;
    bench_.frames.add();
    FakeTracker& tracker = bench_.tracker;
    if (taking_ && requested_ && tracker.state != ZeroState::kTaking) taking_ = false;
    if (tracker.state == ZeroState::kRequested) {
      tracker.state = ZeroState::kTaking;
      begin(true);
    } else if (!haveZero_ && !taking_) {
      begin(false);
    }
    if (taking_ && (moves_ || few_) && chance(0.1)) {
      taking_ = false;
      if (requested_) tracker.state = moves_ ? ZeroState::kMoving : ZeroState::kTooFew;
    }
    if (taking_ && ++averaged_ == bench_.zeroFrames) {
      taking_ = false;
      haveZero_ = true;
      if (requested_) tracker.state = ZeroState::kTaken;
      late_ = bench_.pose(static_cast<std::uint8_t>(++taken_), requested_);
    }
    if (haveZero_) bench_.field(few_);
  }

  void begin(bool requested) {
    taking_ = true;
    requested_ = requested;
    averaged_ = 0;
  }

  void expectAsked(const RestPose& pose) {
    if (pose.requested) {
      EXPECT_TRUE(zeroAsked_s_) << "a zero that nobody waits for";
    } else {
      EXPECT_FALSE(std::exchange(haveFirst_, true)) << "a second first zero";
    }
  }

  /// Checks the answers that have come, and that those that are waited for are not late.
  void checkAnswers() {
    while (zeroAnswers_ < bench_.zeroAnswers.size()) {
      ASSERT_TRUE(zeroAsked_s_) << "a second answer: " << bench_.zeroAnswers[zeroAnswers_].error();
      zeroAsked_s_.reset();
      ++zeroAnswers_;
    }
    while (stepAnswers_ < bench_.stepAnswers.size()) {
      ASSERT_TRUE(stepAsked_s_) << "a second answer";
      stepAsked_s_.reset();
      ++stepAnswers_;
    }
    if (zeroAsked_s_) {
      ASSERT_LE(now_s(), zeroUntil_s_) << "a zero asked for at " << *zeroAsked_s_;
    }
    if (stepAsked_s_) {
      ASSERT_LE(now_s(), stepUntil_s_) << "a step asked for at " << *stepAsked_s_;
    }
  }

  std::mt19937 generator_;
  ProceduresBench bench_;
  double weather_until_s_ = 0.0, rate_Hz_ = 60.0, due_ = 0.0;
  bool few_ = false, moves_ = false;
  double diskTakes_s_ = 1.0;

  // The tracker.
  bool haveZero_ = false, haveFirst_ = false, taking_ = false, requested_ = false;
  int averaged_ = 0;
  std::optional<RestPose> late_;  ///< taken, not handed over yet

  std::size_t zeros_ = 0, steps_ = 0, replaced_ = 0, taken_ = 0, zeroAnswers_ = 0, stepAnswers_ = 0;
  std::optional<double> zeroAsked_s_, stepAsked_s_;
  double zeroUntil_s_ = 0.0, stepUntil_s_ = 0.0;
};

TEST(Procedures, WhateverHappensEachRequestGetsOneAnswerInTime) {
  std::size_t zeros = 0, steps = 0, taken = 0;
  for (unsigned number = 0; number < 8; ++number) {
    SCOPED_TRACE("day " + std::to_string(number));
    Day day(test::seed() + number);
    day.run();
    zeros += day.zeros();
    steps += day.steps();
    taken += day.taken();
    if (HasFailure()) break;  // the number of the day is in the trace
  }
  std::printf("%zu zeros asked for, %zu taken, %zu steps\n", zeros, taken, steps);
  EXPECT_GT(taken, zeros / 10);
}

}  // namespace
}  // namespace tractiond::control::procedures_random_test
