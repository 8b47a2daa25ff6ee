// Clocks, losses and disturbances that are drawn at random.
#include "tests/support/seed.h"
#include "tests/unit/capture/frame_gate_bench.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>
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

/// Honest frames between disturbances of every kind. Whatever came before, the third honest frame is used again; no
/// picture is used twice; the numbers add up.
class FrameGateProperty : public testing::TestWithParam<int> {};

TEST_P(FrameGateProperty, HoldsUnderDisturbances) {
  std::mt19937_64 random(static_cast<std::uint64_t>(GetParam()));
  const auto upTo = [&](int n) { return static_cast<int>(random() % static_cast<std::uint64_t>(n)); };
  FrameGate gate(kShape, {});
  Ledger ledger;
  SimulatedCamera camera(65'000 + static_cast<std::uint64_t>(upTo(500)), GetParam() % 2 == 0);

  std::vector<Arrival> past;                                 // whole pictures, the newest last
  std::vector<std::pair<std::uint64_t, std::int64_t>> used;  // what went through
  std::uint64_t arrivals = 0, lastNumber = 0, accepted = 0, summedGaps = 0;
  Arrival lastUsed;
  const auto judge = [&](Arrival arrival) {
    const Judgement judgement = gate.judge(arrival);
    count(judgement, ledger);
    ++arrivals;
    if (arrival.complete && arrival.shape == kShape) past.push_back(arrival);
    if (judgement.verdict == Verdict::kNew) {
      ++accepted;
      EXPECT_EQ(std::count(used.begin(), used.end(), std::pair(arrival.id, arrival.device_ns)), 0);
      EXPECT_GT(judgement.frameNumber, lastNumber);
      if (judgement.timed && !judgement.newTimeline) {
        EXPECT_GT(arrival.device_ns, lastUsed.device_ns);
      }
      summedGaps += judgement.frameNumber - lastNumber - 1;
      EXPECT_LE(judgement.missing, judgement.frameNumber - lastNumber - 1);
      EXPECT_TRUE(judgement.frameNumber == lastNumber + 1 || judgement.discontinuity);
      lastNumber = judgement.frameNumber;
      lastUsed = arrival;
      used.emplace_back(arrival.id, arrival.device_ns);
    }
    return judgement;
  };
  const auto disturb = [&] {
    Arrival odd = camera.take();
    switch (upTo(9)) {
    case 0:
      camera.lose(upTo(200));
      break;
    case 1:
      camera.count(1 + random() % 65'535);
      break;
    case 2:
      camera.step(static_cast<std::int64_t>(random() % 4'000'000'000) - 2'000'000'000);
      break;
    case 3:  // old buffers, alone or in a row
      for (std::size_t i = past.size() - std::min<std::size_t>(past.size(), static_cast<std::size_t>(1 + upTo(20)));
           i < past.size() && upTo(4) != 0; ++i) {
        Arrival old = past[i];
        old.host_ns = camera.hostNow();
        const std::size_t before = past.size();
        EXPECT_EQ(judge(old).verdict, Verdict::kStale);
        past.resize(before);
      }
      break;
    case 4:  // forged: any id, any time
      odd.id = random();
      odd.device_ns = static_cast<std::int64_t>(random());
      odd.host_ns = camera.hostNow();
      judge(odd);
      break;
    case 5:  // forged: near
      odd.id += static_cast<std::uint64_t>(upTo(50));
      odd.device_ns += static_cast<std::int64_t>(random() % 1'000'000'000);
      odd.host_ns = camera.hostNow();
      judge(odd);
      break;
    case 6:
      odd.complete = false;
      judge(odd);
      break;
    case 7:
      odd.shape.size -= 1;
      judge(odd);
      break;
    case 8:
      gate.restart();
      break;
    }
  };

  for (int round = 0; round < 200; ++round) {
    for (int i = upTo(6); i > 0; --i) disturb();
    int needed = 1;
    while (needed <= 3 && judge(camera.take()).verdict != Verdict::kNew) ++needed;
    ASSERT_LE(needed, 3) << "round " << round;
    for (int i = upTo(100); i > 0; --i) {
      camera.delay(static_cast<std::int64_t>(random() % 10'000'000));
      ASSERT_EQ(judge(camera.take()).verdict, Verdict::kNew) << "round " << round;
    }
  }
  EXPECT_EQ(ledger.received.get(), arrivals);
  EXPECT_EQ(ledger.received.get(), accepted + ledger.losses());
  EXPECT_EQ(lastNumber, accepted + summedGaps);
  EXPECT_LE(ledger.missing.get(), summedGaps);
}

INSTANTIATE_TEST_SUITE_P(Seeds, FrameGateProperty, testing::Range(0, 40));

/// With honest losses only, every frame the camera took is accounted for exactly.
TEST_F(FrameGateTest, AccountsForEveryFrameOfAnHonestCamera) {
  std::mt19937 random(7);
  SimulatedCamera camera(60'000);
  std::uint64_t taken = 0, never = 0, refused = 0;
  Judgement last;
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
    if (judgement.verdict == Verdict::kNew) last = judgement;
    ASSERT_EQ(judgement.verdict == Verdict::kNew, arrival.complete);
  }
  Judgement end;
  EXPECT_EQ(framesUntilNew(camera, &end), 1);
  EXPECT_EQ(end.frameNumber, taken + 1);
  EXPECT_EQ(ledger_.missing.get(), never);
  EXPECT_EQ(ledger_.incomplete.get(), refused);
}

}  // namespace
}  // namespace tractiond::capture::frame_gate_test
