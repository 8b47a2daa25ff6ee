// Clocks, losses and disturbances that are drawn at random.
#include "tests/support/seed.h"
#include "tests/unit/capture/frame_gate_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace tractiond::capture::frame_gate_test {
namespace {

/// Device clocks as they are, at random: absent, of any resolution, going back or ahead now and then.
class OddClock {
 public:
  explicit OddClock(std::mt19937_64& random)
      : kind_(static_cast<Kind>(random() % 4))
      , resolution_ns_(static_cast<std::int64_t>(std::pow(10.0, static_cast<double>(random() % 80) / 10.0 + 2.0)))
      , every_(20 + random() % 200) {}
  void date(Arrival& arrival, std::mt19937_64& random) {
    if (kind_ == kAbsent) arrival.device_ns = 0;
    if (kind_ == kCoarse) arrival.device_ns -= arrival.device_ns % resolution_ns_;
    if (kind_ >= kBack && random() % every_ == 0)
      step_ns_ += (kind_ == kBack ? -1 : 1) * static_cast<std::int64_t>(random() % 2'000'000'000);
    arrival.device_ns += step_ns_;
  }
  const char* name() const { return std::array{"absent", "coarse", "back", "ahead"}[kind_]; }

 private:
  enum Kind { kAbsent, kCoarse, kBack, kAhead } kind_;
  std::int64_t resolution_ns_, step_ns_ = 0;
  std::uint64_t every_;
};

/// Whatever the camera's clock is worth: every whole picture is used once, and no old one is used again.
TEST_F(FrameGateTest, UsesEveryFrameOfACameraWithAnOddClock) {
  std::mt19937_64 random(test::seed());
  for (int round = 0; round < 200; ++round) {
    FrameGate gate(kShape, {.memory = 1100});
    SimulatedCamera camera(1 + random() % 65'535);
    OddClock clock(random);
    std::vector<Arrival> past;
    std::uint64_t number = 0;
    for (int i = 0; i < 600; ++i) {
      camera.delay(static_cast<std::int64_t>(random() % 6'000'000));
      Arrival arrival = camera.take();
      arrival.content = random();
      clock.date(arrival, random);
      const Judgement judgement = gate.judge(arrival);
      ASSERT_EQ(judgement.verdict, Verdict::kNew) << clock.name() << ", frame " << i << " of round " << round;
      ASSERT_EQ(judgement.frameNumber, ++number) << clock.name();
      ASSERT_EQ(judgement.missing, 0U);
      past.push_back(arrival);
      if (i > 20 && random() % 50 == 0) {  // a recycled buffer comes out again, alone or with those after it
        std::size_t old = past.size() - 1 - random() % std::min<std::size_t>(past.size() - 1, 1000);
        for (std::size_t n = random() % 6; old < past.size() && n > 0; ++old, --n) {
          Arrival again = past[old];
          again.host_ns = camera.hostNow();
          ASSERT_EQ(gate.judge(again).verdict, Verdict::kStale) << clock.name();
        }
      }
    }
  }
}

/// With honest losses only, every frame the camera took is accounted for exactly.
TEST_F(FrameGateTest, AccountsForEveryFrameOfAnHonestCamera) {
  std::mt19937 random(7);
  SimulatedCamera camera(60'000);
  std::uint64_t taken = 0, never = 0, refused = 0;
  for (int i = 0; i < 100'000; ++i) {
    Arrival arrival = camera.take();
    ++taken;
    const auto fate = random() % 100;
    if (fate < 5 && i > 0) {
      ++never;
      continue;
    }
    if (fate < 15 && i > 0) {
      arrival.complete = false;
      if (fate < 7) arrival.id = 0;
      ++refused;
    }
    const Judgement judgement = judge(arrival);
    ASSERT_EQ(judgement.verdict == Verdict::kNew, arrival.complete);
  }
  const Judgement end = judge(camera.take());
  EXPECT_EQ(end.frameNumber, taken + 1);
  EXPECT_EQ(ledger_.missing.get(), never);
  EXPECT_EQ(ledger_.incomplete.get(), refused);
}

}  // namespace
}  // namespace tractiond::capture::frame_gate_test
