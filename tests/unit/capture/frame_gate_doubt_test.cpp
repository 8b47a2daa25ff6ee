// Whose pictures are these? Packets that come twice, late or early.
#include "tests/support/seed.h"
#include "tests/unit/capture/frame_gate_bench.h"

#include <algorithm>
#include <random>

namespace tractiond::capture::frame_gate_doubt_test {
namespace {

/// Packets that come late or twice for a reason, drawn at random: none of them is held against the camera.
TEST_F(FrameGateTest, DoubtsNoCameraForWhatANetworkDoes) {
  std::mt19937 random(test::seed());
  const auto oneIn = [&](unsigned n) { return random() % n == 0; };
  SimulatedCamera camera(40'000);
  stream(camera, 100);
  for (int i = 0; i < 20'000; ++i) {
    if (oneIn(40)) {  // a frame is given up, and some of its packets come after the next one
      Arrival broken = camera.take();
      broken.complete = false;
      judge(broken);
      Arrival next = camera.take();
      next.late = static_cast<double>(random() % 100) / 100;
      ASSERT_FALSE(judge(next).doubted) << i;
    }
    if (oneIn(500)) {  // the counter starts anew: Aravis throws away what is up to a hundred older
      const std::uint64_t back = 1 + random() % 99;
      if (camera.nextId() > back + 1) {
        const std::uint64_t id = camera.nextId();
        camera.count(id - back);
        camera.lose(static_cast<int>(back));
        Arrival next = camera.take();
        next.thrown = back;
        next.late = static_cast<double>(back);
        const Judgement judgement = judge(next);
        ASSERT_FALSE(judgement.doubted) << i << ", " << back << " back";
      }
    }
    ASSERT_FALSE(judge(camera.take()).doubted) << i;
  }
  EXPECT_EQ(ledger_.doubted.get(), 0U);
}

TEST_F(FrameGateTest, DoubtsWhatComesBesideTheCamera) {
  std::mt19937 random(test::seed());
  for (int i = 0; i < 200; ++i) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(1 + random() % 65'000);
    for (int k = 0; k < 50; ++k) ASSERT_FALSE(gate.judge(camera.take()).doubted);
    const bool late = random() % 2 == 0;
    if (!late) {  // a frame given up is no reason why others come twice
      Arrival broken = camera.take();
      broken.complete = false;
      gate.judge(broken);
    }
    Arrival surplus = camera.take();  // of one packet up to three frames
    (late ? surplus.late : surplus.twice) = 1.0 / 200 + 3.0 * static_cast<double>(random() % 1000) / 1000;
    surplus.thrown = static_cast<std::uint64_t>(surplus.late);
    const Judgement judgement = gate.judge(surplus);
    ASSERT_EQ(judgement.verdict, Verdict::kNew);
    EXPECT_TRUE(judgement.doubted) << surplus.late << " late, " << surplus.twice << " twice";
    int frames = 1;
    while (gate.judge(camera.take()).doubted && frames < 1000) ++frames;
    EXPECT_NEAR(frames, 2e9 / kPeriod_ns, 2);
  }
}

TEST_F(FrameGateTest, DoubtsThatPictureOnlyOfWhichAPacketThatWasAskedForCameTwice) {
  SimulatedCamera camera(40'000);
  stream(camera, 100);
  Arrival broken = camera.take();
  broken.complete = false;
  broken.repeated = true;
  judge(broken);
  const Judgement next = judge(camera.take());
  EXPECT_TRUE(next.doubted);
  EXPECT_FALSE(next.outnumbered);
  EXPECT_FALSE(judge(camera.take()).doubted);
}

TEST_F(FrameGateTest, DoubtsTheOriginWherePacketsComeTwiceInOneFrameAfterAnother) {
  SimulatedCamera camera(40'000);
  stream(camera, 100);
  for (int frames = 0;; ++frames) {
    ASSERT_LT(frames, 10);
    Arrival repeated = camera.take();
    repeated.repeated = true;
    const Judgement judgement = judge(repeated);
    EXPECT_TRUE(judgement.doubted);
    if (judgement.outnumbered) break;
  }
  EXPECT_TRUE(judge(camera.take()).outnumbered);
}

/// A picture of now, whole before the camera's own can be.
TEST_F(FrameGateTest, DoubtsWhatComesBeforeItCanHaveBeenSent) {
  std::mt19937 random(test::seed());
  for (int i = 0; i < 200; ++i) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(1 + random() % 60'000);
    const auto late_ns = static_cast<std::int64_t>(random() % 1'000'000);  // by which its frames differ, up to
    camera.delay(20'000'000);
    for (int k = 0; k < 200; ++k) {
      Arrival honest = camera.take();
      honest.host_ns += late_ns == 0 ? 0 : static_cast<std::int64_t>(random()) % late_ns;
      ASSERT_FALSE(gate.judge(honest).doubted) << i << ", " << k;
    }
    Arrival forged = camera.take();
    forged.host_ns -= std::max<std::int64_t>(3'100'000, 8 * late_ns) + static_cast<std::int64_t>(random() % 1'000'000);
    const Judgement judgement = gate.judge(forged);
    ASSERT_EQ(judgement.verdict, Verdict::kNew);
    EXPECT_TRUE(judgement.doubted) << i;
    EXPECT_FALSE(judgement.outnumbered);
  }
}

}  // namespace
}  // namespace tractiond::capture::frame_gate_doubt_test
