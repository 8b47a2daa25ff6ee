// Frames that are new, stale, missing or implausible, each case by itself.
#include "tests/unit/capture/frame_gate_bench.h"

#include <random>
#include <vector>

namespace tractiond::capture::frame_gate_test {
namespace {

TEST_F(FrameGateTest, FollowsA64BitCounterBeyond16And32Bits) {
  for (const std::uint64_t first : {std::uint64_t{65'400}, (std::uint64_t{1} << 32) - 100, std::uint64_t{1} << 63}) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(first, true);
    for (int i = 0; i < 300; ++i) ASSERT_EQ(gate.judge(camera.take()).verdict, Verdict::kNew) << first << " + " << i;
  }
}

TEST_F(FrameGateTest, TakesIdZeroFromUsbOnly) {
  SimulatedCamera camera(0);
  EXPECT_EQ(judge(camera.take()).verdict, Verdict::kStale);
  FrameGate usb(kShape, {.zeroIsAnId = true});
  SimulatedCamera other(0);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(usb.judge(other.take()).verdict, Verdict::kNew);
}

TEST_F(FrameGateTest, TakesNoFifthPictureThatEqualsTheOnesBeforeUntilOneDiffers) {
  SimulatedCamera camera(65'000);
  std::uint64_t number = 0;
  const auto take = [&](std::uint64_t whole, Verdict expected) {
    Arrival arrival = camera.take();
    arrival.whole = whole;
    const Judgement judgement = judge(arrival);
    EXPECT_EQ(judgement.verdict, expected);
    EXPECT_EQ(judgement.frameNumber, ++number);
    EXPECT_EQ(judgement.missing, 0U);
    return judgement;
  };
  for (const std::uint64_t whole : {0, 7, 7, 7}) take(whole, Verdict::kNew);
  constexpr std::uint64_t kFrozen = 40'000;  // longer than ids of 16 bits tell apart
  for (std::uint64_t i = 0; i < kFrozen; ++i) take(7, Verdict::kRepeated);
  EXPECT_TRUE(take(8, Verdict::kNew).discontinuity) << "only the sample is the same";
  for (const std::uint64_t whole : {8, 8, 8}) EXPECT_FALSE(take(whole, Verdict::kNew).discontinuity);
  take(8, Verdict::kRepeated);
  EXPECT_TRUE(take(0, Verdict::kNew).discontinuity);
  EXPECT_EQ(ledger_.repeated.get(), kFrozen + 1);
  EXPECT_EQ(ledger_.losses(), kFrozen + 1);
}

TEST_F(FrameGateTest, CountsWhatNeverArrivedApartFromWhatArrivedBroken) {
  SimulatedCamera camera(1);
  stream(camera, 5);
  camera.lose(3);
  Arrival broken = camera.take();
  broken.complete = false;
  broken.shape = {};
  EXPECT_EQ(judge(broken).verdict, Verdict::kIncomplete);
  Arrival unnamed = camera.take();  // the packet that carries id and time was lost: those are an older frame's
  unnamed.complete = false;
  unnamed.id = 2;
  EXPECT_EQ(judge(unnamed).verdict, Verdict::kIncomplete);
  Arrival small = camera.take();
  small.shape.size = 1000;
  EXPECT_EQ(judge(small).verdict, Verdict::kWrongSize);
  Arrival narrow = camera.take();
  narrow.shape.width = 600;
  EXPECT_EQ(judge(narrow).verdict, Verdict::kWrongSize);
  Arrival grey = camera.take();
  grey.shape.format = 0x01080001;
  EXPECT_EQ(judge(grey).verdict, Verdict::kWrongFormat);
  const Judgement next = judge(camera.take());
  EXPECT_EQ(next.verdict, Verdict::kNew);
  EXPECT_EQ(next.missing, 3U);
  EXPECT_EQ(next.frameNumber, 5U + 3 + 5 + 1);
  EXPECT_TRUE(next.discontinuity);
  EXPECT_EQ(ledger_.incomplete.get(), 2U);
  EXPECT_EQ(ledger_.wrongSize.get(), 2U);
  EXPECT_EQ(ledger_.wrongFormat.get(), 1U);
  EXPECT_EQ(ledger_.missing.get(), 3U);
}

TEST_F(FrameGateTest, DoubtsThePictureOfWhichPacketsCameTwice) {
  SimulatedCamera camera(1);
  stream(camera, 100);
  Arrival lost = camera.take();
  lost.complete = false;
  lost.duplicated = true;
  EXPECT_FALSE(judge(lost).doubted);
  EXPECT_TRUE(judge(camera.take()).doubted) << "the packets may be of this one";
  EXPECT_FALSE(judge(camera.take()).doubted);
  EXPECT_EQ(ledger_.doubted.get(), 1U);
}

TEST_F(FrameGateTest, LosesNothingToOneForgedFutureId) {
  for (const std::uint64_t ahead : {2U, 3U, 10U, 100U, 1'000U, 30'000U, 40'000U, 65'534U, 100'000U}) {
    for (const std::int64_t later_ns : {std::int64_t{1}, kPeriod_ns, 100 * kPeriod_ns, std::int64_t{1} << 60}) {
      FrameGate gate(kShape, {});
      SimulatedCamera camera(20'000);
      for (int i = 0; i < 100; ++i) ASSERT_EQ(gate.judge(camera.take()).verdict, Verdict::kNew);
      Arrival forged = camera.take();
      Arrival real = forged;
      forged.id += ahead;
      forged.device_ns += later_ns;
      const Verdict verdict = gate.judge(forged).verdict;
      EXPECT_TRUE(verdict == Verdict::kImplausible || verdict == Verdict::kStale) << ahead << ' ' << later_ns;
      for (int i = 0; i < 100; ++i) {
        ASSERT_EQ(gate.judge(real).verdict, Verdict::kNew) << ahead << ' ' << later_ns;
        real = camera.take();
      }
    }
  }
}

TEST_F(FrameGateTest, ResynchronisesOnThreeFramesAfterACounterReset) {
  for (const std::uint64_t before : {300U, 40'000U, 65'000U, 65'534U}) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(before - 100);
    for (int i = 0; i < 100; ++i) ASSERT_EQ(gate.judge(camera.take()).verdict, Verdict::kNew);
    camera.count(1);
    if (before == 65'534) camera.count(20'000);
    EXPECT_NE(gate.judge(camera.take()).verdict, Verdict::kNew) << before;
    EXPECT_NE(gate.judge(camera.take()).verdict, Verdict::kNew) << before;
    const Judgement judgement = gate.judge(camera.take());
    EXPECT_EQ(judgement.verdict, Verdict::kNew) << before;
    EXPECT_TRUE(judgement.newTimeline && judgement.discontinuity);
    EXPECT_EQ(judgement.missing, 0U) << "unknown, so not counted";
    EXPECT_EQ(judgement.frameNumber, 101U);
    for (int i = 0; i < 100; ++i) ASSERT_EQ(gate.judge(camera.take()).verdict, Verdict::kNew);
  }
}

TEST_F(FrameGateTest, LosesNothingWhenTheCamerasClockSteps) {
  for (const std::int64_t step_ns : {std::int64_t{3'600'000'000'000}, std::int64_t{200'000'000}, -kPeriod_ns * 2,
                                     std::int64_t{-3'600'000'000'000}}) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(100);
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(gate.judge(camera.take()).timed);
    camera.step(step_ns);
    Judgement judgement = gate.judge(camera.take());
    EXPECT_EQ(judgement.verdict, Verdict::kNew) << step_ns;
    EXPECT_TRUE(judgement.newTimeline && judgement.discontinuity);
    EXPECT_FALSE(judgement.timed) << "it may step again";
    EXPECT_EQ(judgement.frameNumber, 101U);
    int untimed = 1;
    for (int i = 0; i < 200; ++i) {
      judgement = gate.judge(camera.take());
      ASSERT_EQ(judgement.verdict, Verdict::kNew);
      EXPECT_FALSE(judgement.discontinuity);
      EXPECT_EQ(judgement.missing, 0U);
      untimed += judgement.timed ? 0 : 1;
    }
    EXPECT_EQ(untimed, 100) << "then it is believed again";
  }
}

TEST_F(FrameGateTest, AStallOfTheHostIsNoStepOfTheClock) {
  SimulatedCamera camera(100);
  stream(camera, 100);
  // Ten frames wait for 700 ms and come in a burst.
  std::vector<Arrival> waiting;
  for (int i = 0; i < 10; ++i) waiting.push_back(camera.take());
  camera.pass(700'000'000);
  for (Arrival& frame : waiting) {
    frame.host_ns = camera.hostNow();
    EXPECT_EQ(judge(frame).verdict, Verdict::kNew);
  }
  camera.lose(0);
  camera.count(camera.nextId() + 42);  // what the driver had no buffers for
  const Judgement judgement = judge(camera.take());
  EXPECT_EQ(judgement.verdict, Verdict::kNew);
  EXPECT_EQ(judgement.missing, 42U);
}

TEST_F(FrameGateTest, ATriggerMayPauseAndHurry) {
  SimulatedCamera camera(10);
  std::mt19937 random(1);
  std::exponential_distribution<double> pause(1.0);
  for (int i = 0; i < 2000; ++i) {
    ASSERT_EQ(judge(camera.take()).verdict, Verdict::kNew) << i;
    camera.pass(static_cast<std::int64_t>(pause(random) * 5e8));
  }
}

TEST_F(FrameGateTest, UsesTheFirstFrameOfAReopenedCamera) {
  SimulatedCamera camera(100);
  stream(camera, 50);
  // It comes back with other ids and another clock.
  gate_.restart();
  camera.count(1);
  camera.setClock(5);
  camera.pass(8'000'000'000);
  Judgement judgement = judge(camera.take());
  EXPECT_EQ(judgement.verdict, Verdict::kNew);
  EXPECT_TRUE(judgement.newTimeline && judgement.discontinuity);
  EXPECT_EQ(judgement.frameNumber, 51U);
  EXPECT_EQ(judgement.missing, 0U);
  stream(camera, 50);
  // Or it went on counting behind a pulled cable.
  gate_.restart();
  camera.lose(200);
  judgement = judge(camera.take());
  EXPECT_EQ(judgement.verdict, Verdict::kNew);
  EXPECT_TRUE(judgement.newTimeline && judgement.discontinuity);
  EXPECT_EQ(judgement.missing, 200U);
  EXPECT_EQ(judgement.frameNumber, 101U + 200 + 1);
}

}  // namespace
}  // namespace tractiond::capture::frame_gate_test
