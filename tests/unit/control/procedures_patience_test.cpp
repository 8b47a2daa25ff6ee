// The time that a requested zero may take, and what refuses it before.
#include "tests/unit/control/procedures_bench.h"

#include <gtest/gtest.h>

namespace tractiond::control::procedures_test {
namespace {

/// At a rate, for a time: turns as the daemon makes them.
void run(ProceduresBench& bench, double seconds, double rate_Hz) {
  const double begin_s = 1e-9 * static_cast<double>(bench.now_ns);
  for (double next_s = begin_s, now_s = begin_s; now_s < begin_s + seconds; now_s += 0.1) {
    for (; rate_Hz > 0.0 && next_s <= now_s; next_s += 1.0 / rate_Hz) bench.frames.add();
    bench.turn();
    bench.pass(100);
  }
}

TEST(Procedures, AZeroThatWasRefusedIsNotAskedForAnyMore) {
  ProceduresBench bench;
  bench.procedures.zero().begin({});
  run(bench, 5.3, 0.0);
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_EQ(bench.zeroAnswers[0].error(), "no frames come from the camera");
  EXPECT_FALSE(bench.tracker.asked());  // when frames return, what is then on the gel is a load
  run(bench, 60.0, 60.0);
  EXPECT_EQ(bench.zeroAnswers.size(), 1U);
}

TEST(Procedures, AsLongAsFramesComeAZeroMayTakeItsTime) {
  ProceduresBench bench(10'000);
  bench.procedures.welcome("Camera-1", 30.0, std::nullopt);
  bench.procedures.zero().begin({});
  run(bench, 340.0, 30.0);
  EXPECT_TRUE(bench.zeroAnswers.empty());
  EXPECT_TRUE(bench.tracker.asked());
}

TEST(Procedures, AZeroThatHasJustBeenTakenIsTheAnswerAlsoWhenItIsTooLate) {
  ProceduresBench bench;
  bench.procedures.zero().begin({});
  run(bench, 5.05, 0.0);
  bench.tracker.state = track::ZeroState::kTaken;  // its pose is on the way
  run(bench, 1.0, 0.0);
  EXPECT_TRUE(bench.zeroAnswers.empty());
  bench.tracker.finish(bench.pose(1, true));
  bench.turn();
  ASSERT_EQ(bench.zeroAnswers.size(), 1U);
  EXPECT_TRUE(bench.zeroAnswers[0]);
}

TEST(Procedures, ATrackersRefusalIsTheAnswer) {
  for (const auto state : {track::ZeroState::kMoving, track::ZeroState::kTooFew, track::ZeroState::kTorn}) {
    ProceduresBench bench;
    bench.procedures.zero().begin({});
    bench.tracker.state = state;
    bench.turn();
    bench.turn();
    ASSERT_EQ(bench.zeroAnswers.size(), 1U);
    EXPECT_EQ(bench.zeroAnswers[0].error(), track::describe(state));
  }
}

TEST(Procedures, SaysHowLongAZeroMayTakeAndKeepsToIt) {
  struct Case {
    int frames;
    double told_Hz, real_Hz;
  };
  constexpr double kKeptWithin_s = 1e-9 * static_cast<double>(ZeroProcedure::kKeptWithin_ns);
  for (const Case& c :
       {Case{30, 60.0, 60.0}, {30, 0.0, 12.5}, {10'000, 30.0, 30.0}, {100, 60.0, 2.0}, {30, 0.0, 0.3}, {2, 0.0, 0.3}}) {
    SCOPED_TRACE(testing::Message() << c.frames << " frames at " << c.real_Hz << " / s");
    ProceduresBench bench(c.frames);
    bench.procedures.welcome("Camera-1", c.told_Hz, std::nullopt);
    run(bench, 10.0, c.real_Hz);
    const double within_s = bench.zeroWithin_s();
    const double frames_s = (2 * c.frames + 2) / c.real_Hz;  // as many may be torn, and two may be under way
    EXPECT_GE(within_s, kKeptWithin_s + 5.0 + 0.9 * frames_s);
    EXPECT_LE(within_s, kKeptWithin_s + 5.1 + 1.2 * frames_s);
    bench.procedures.zero().begin({});
    run(bench, within_s - kKeptWithin_s - 0.5, c.real_Hz);
    EXPECT_TRUE(bench.zeroAnswers.empty());
    run(bench, 1.0, c.real_Hz);
    ASSERT_EQ(bench.zeroAnswers.size(), 1U);
    EXPECT_NE(bench.zeroAnswers[0].error().find("too slowly"), std::string::npos) << bench.zeroAnswers[0].error();
    EXPECT_FALSE(bench.tracker.asked());
  }
}

}  // namespace
}  // namespace tractiond::control::procedures_test
