// Whose pictures are these? Packets that come twice, late or early, and pictures that come beside the camera's.
#include "tests/support/seed.h"
#include "tests/unit/capture/frame_gate_bench.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
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
        ASSERT_TRUE(judgement.discontinuity) << back << " back";
        ASSERT_EQ(judgement.missing, back);
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
    EXPECT_EQ(judgement.missing, 0U) << surplus.thrown << " thrown away, for which there was no time";
    int frames = 1;
    while (gate.judge(camera.take()).doubted && frames < 1000) ++frames;
    EXPECT_NEAR(frames, 2e9 / kPeriod_ns, 2);
  }
}

/// The camera's own picture after a forged one of its id. A picture that comes late leaves the host's clock room for
/// it.
TEST_F(FrameGateTest, DoubtsASurplusFrameBeforeAPictureThatComesLate) {
  for (const bool hasClock : {true, false}) {
    for (int late_ms = 0; late_ms <= 200; late_ms += 5) {
      FrameGate gate(kShape, {});
      SimulatedCamera camera(40'000);
      const auto take = [&] {
        Arrival arrival = camera.take();
        if (!hasClock) arrival.device_ns = 0;
        return arrival;
      };
      for (int k = 0; k < 150; ++k) ASSERT_FALSE(gate.judge(take()).outnumbered);
      camera.delay(1'000'000 * late_ms);
      Arrival next = take();
      next.thrown = 1;
      next.late = 1.0;
      const Judgement judgement = gate.judge(next);
      EXPECT_TRUE(judgement.outnumbered) << late_ms << " ms";
      if (!hasClock) continue;
      EXPECT_EQ(judgement.missing, 0U) << late_ms << " ms: there was no time for the one thrown away";
    }
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

/// Another host's picture of the next id and of now, half a period before the camera's own, at a host that is held up
/// now and then.
TEST_F(FrameGateTest, DoubtsWhatComesEarlyHoweverUnevenlyTheCamerasPicturesCome) {
  std::mt19937 random(test::seed());
  for (int i = 0; i < 200; ++i) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(1 + random() % 60'000);
    std::int64_t free_ns = 0;  // the host, from when on
    for (int k = 0; k < 400; ++k) {
      Arrival honest = camera.take();
      if (random() % 10 == 0 || k == 398)
        free_ns = honest.host_ns + 10'000'000 + static_cast<std::int64_t>(random() % 50'000'000);
      honest.host_ns = std::max(honest.host_ns, free_ns);
      ASSERT_FALSE(gate.judge(honest).doubted) << i << ", " << k;
    }
    camera.lose(4);  // of which the last may have been held up
    Arrival forged = camera.take();
    forged.host_ns -= kPeriod_ns / 2;
    const Judgement judgement = gate.judge(forged);
    ASSERT_EQ(judgement.verdict, Verdict::kNew);
    EXPECT_TRUE(judgement.doubted) << i;
    EXPECT_FALSE(judgement.outnumbered);
  }
}

/// Another host's picture of the next id, long before the camera's own; its stamp is earlier, too, and hides that.
TEST_F(FrameGateTest, DoubtsAPictureWhoseStampComesBeforeItsNumberIsDue) {
  std::mt19937 random(test::seed());
  for (int i = 0; i < 200; ++i) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(1 + random() % 60'000);
    const auto uneven_ns = 1 + static_cast<std::int64_t>(random() % 200'000);  // the camera's stamps
    for (int k = 0; k < 200; ++k) {
      Arrival honest = camera.take();
      honest.device_ns += static_cast<std::int64_t>(random()) % uneven_ns;
      ASSERT_FALSE(gate.judge(honest).doubted) << i << ", " << k;
    }
    Arrival forged = camera.take();
    const std::int64_t early_ns =
        kPeriod_ns / 4 + 300'000 + static_cast<std::int64_t>(random()) % (3 * kPeriod_ns / 4 - 1'000'000);
    forged.host_ns -= early_ns;
    forged.device_ns -= early_ns;
    const Judgement judgement = gate.judge(forged);
    ASSERT_EQ(judgement.verdict, Verdict::kNew);
    EXPECT_TRUE(judgement.doubted) << i << ", " << early_ns;
    EXPECT_FALSE(judgement.outnumbered);
  }
}

TEST_F(FrameGateTest, DoubtsThePictureAtWhichTheClockJumps) {
  for (const std::int64_t step_ns : {std::int64_t{5'000'000'000}, std::int64_t{-5'000'000'000}}) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(40'000);
    for (int k = 0; k < 200; ++k) ASSERT_FALSE(gate.judge(camera.take()).doubted);
    camera.step(step_ns);
    EXPECT_TRUE(gate.judge(camera.take()).doubted) << step_ns;
    for (int k = 0; k < 300; ++k) ASSERT_FALSE(gate.judge(camera.take()).doubted) << step_ns << ", " << k;
  }
}

/// Cameras that stamp by their operating system, that are triggered, or whose rate is changed.
TEST_F(FrameGateTest, DoubtsNoCameraWhosePicturesAreUneven) {
  std::mt19937 random(test::seed());
  std::exponential_distribution<double> often(1.0);
  for (int i = 0; i < 50; ++i) {
    FrameGate stamped(kShape, {}), triggered(kShape, {}), paused(kShape, {});
    SimulatedCamera camera(1), waiting(1), stopped(1);
    const double late_ns = 1e6 * often(random);
    for (int k = 0; k < 2000; ++k) {
      Arrival one = camera.take();
      const auto uneven_ns = std::min<std::int64_t>(
          std::llround(late_ns * often(random)) + (random() % 300 == 0 ? 9'000'000 : 0), 16'000'000);
      one.device_ns += uneven_ns;
      one.host_ns += uneven_ns;
      ASSERT_FALSE(stamped.judge(one).doubted) << i << ", " << k;
      waiting.pass(std::llround(5e7 * often(random)));
      ASSERT_FALSE(triggered.judge(waiting.take()).doubted) << i << ", " << k;
      if (random() % 50 == 0) stopped.pass(std::llround(1e9 * often(random)));
      if (random() % 50 == 0) stopped.lose(static_cast<int>(random() % 12));
      ASSERT_FALSE(paused.judge(stopped.take()).doubted) << i << ", " << k;
    }
  }
}

TEST_F(FrameGateTest, DoubtsFewPicturesWhenTheRateChanges) {
  for (const std::int64_t faster_ns : {1'500'000, 3'000'000, 8'000'000, 15'000'000}) {
    SimulatedCamera camera(1);
    FrameGate gate(kShape, {});
    int doubted = 0;
    for (int k = 0; k < 1500; ++k) {
      doubted += gate.judge(camera.take()).doubted ? 1 : 0;
      if (k / 500 == 1) camera.pass(-faster_ns);
    }
    EXPECT_LE(doubted, 4) << faster_ns;
  }
}

/// The camera's settings were changed: its pictures have another size, and those of the agreed size are another host's.
TEST_F(FrameGateTest, DoubtsPicturesBesideACameraOfAnotherSizeThatWasOpenedAnew) {
  for (const bool isForgedFirst : {false, true}) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(40'000), forger(7);
    for (int k = 0; k < 200; ++k) {
      forger.pass(kPeriod_ns);
      ASSERT_FALSE(gate.judge(camera.take()).doubted);
    }
    gate.restart();
    camera.count(1);
    camera.pass(500'000'000);
    forger.pass(508'000'000);
    forger.count(30'000);
    int unflagged = 0, forged = 0;
    for (int k = 0; k < 300; ++k) {
      Arrival own = camera.take();
      ++own.shape.width;
      if (!isForgedFirst || k > 0) {
        EXPECT_EQ(gate.judge(own).verdict, Verdict::kWrongSize);
      }
      const Judgement judgement = gate.judge(forger.take());
      ASSERT_EQ(judgement.verdict, Verdict::kNew);
      ++forged;
      unflagged += judgement.doubted ? 0 : 1;
      EXPECT_TRUE(k < 5 || judgement.outnumbered) << k;
    }
    EXPECT_EQ(unflagged, isForgedFirst ? 1 : 0) << "of " << forged;
  }
}

/// The counter starts anew beside another host's pictures, so that neither is used, until it comes to where it was.
TEST_F(FrameGateTest, TellsTheGapOfACounterThatComesBackToItsOldIdAmongForgedPictures) {
  SimulatedCamera camera(100), forger(30'000);
  stream(camera, 100);  // the next one is 200
  forger.pass(100 * kPeriod_ns + kPeriod_ns / 2);
  camera.count(1);
  Judgement judgement;
  int heldBack = 0;
  while ((judgement = judge(camera.take())).verdict != Verdict::kNew && heldBack < 1000) {
    EXPECT_NE(judge(forger.take()).verdict, Verdict::kNew);
    ++heldBack;
  }
  EXPECT_EQ(heldBack, 199);
  EXPECT_TRUE(judgement.discontinuity);
  EXPECT_TRUE(judgement.doubted);
}

/// Of a new timeline it is not known whose it is: a picture of another one beside it makes it doubtful at once.
TEST_F(FrameGateTest, DoubtsANewTimelineWithTheFirstPictureBesideIt) {
  SimulatedCamera camera(40'000);
  for (int k = 0; k < 10; ++k) ASSERT_FALSE(judge(camera.take()).doubted);
  Arrival odd = camera.take();
  odd.id = 3;
  EXPECT_NE(judge(odd).verdict, Verdict::kNew);
  EXPECT_TRUE(judge(camera.take()).doubted);
  EXPECT_FALSE(judge(camera.take()).doubted);
}

/// Whole pictures of somebody else's at the camera's address, of any id, time, phase and rate, beside the camera's own,
/// some of which arrive damaged or not at all. Returns what became of them.
struct Forgery {
  int forgedPublished = 0, forgedUnflagged = 0, honestPublished = 0, honest = 0;
  std::int64_t alarm_ns = 0;  ///< after the third forged picture; 0: never
};
Forgery forge(std::mt19937_64& random, bool alwaysAhead) {
  const auto upTo = [&](std::uint64_t n) { return static_cast<std::int64_t>(random() % n); };
  FrameGate gate(kShape, {});
  SimulatedCamera camera(1 + random() % 65'000);
  for (int k = 0; k < 150; ++k) EXPECT_FALSE(gate.judge(camera.take()).doubted);
  // Far off: nearer ones silence the camera, and Aravis's counts of late packets show them.
  std::uint64_t id = (camera.nextId() + 200 + static_cast<std::uint64_t>(upTo(65'000))) % 65'535 + 1;
  std::int64_t ahead_ns = alwaysAhead ? 0 : upTo(2'000'000'000) - 1'000'000'000;  // of the forged clock
  const std::int64_t period_ns = kPeriod_ns / 8 + upTo(static_cast<std::uint64_t>(2 * kPeriod_ns));
  const std::uint64_t damaged = static_cast<std::uint64_t>(upTo(100)),
                      lost = static_cast<std::uint64_t>(upTo(10));  // %
  std::int64_t next_ns = camera.hostNow() + upTo(static_cast<std::uint64_t>(kPeriod_ns)), third_ns = 0;
  Forgery result;
  for (int k = 0, sent = 0; k < 120; ++k) {
    Arrival own = camera.take();
    for (; next_ns < own.host_ns; next_ns += period_ns) {
      Arrival forged = own;
      forged.id = id = id % 65'535 + 1;
      forged.device_ns = own.device_ns + ahead_ns + next_ns - own.host_ns;
      forged.host_ns = next_ns;
      const Judgement judgement = gate.judge(forged);
      if (++sent == 3) third_ns = next_ns;
      if (judgement.outnumbered && result.alarm_ns == 0)
        result.alarm_ns = std::max<std::int64_t>(1, next_ns - third_ns);
      if (judgement.verdict != Verdict::kNew) continue;
      ++result.forgedPublished;
      result.forgedUnflagged += judgement.doubted ? 0 : 1;
    }
    if (random() % 100 < lost) continue;
    own.complete = random() % 100 >= damaged;
    result.honest += own.complete ? 1 : 0;
    const Judgement judgement = gate.judge(own);
    if (judgement.outnumbered && result.alarm_ns == 0 && third_ns != 0)
      result.alarm_ns = std::max<std::int64_t>(1, own.host_ns - third_ns);
    result.honestPublished += judgement.verdict == Verdict::kNew ? 1 : 0;
  }
  return result;
}

TEST_F(FrameGateTest, PublishesNoForgedPictureOfAFarOffIdUnflagged) {
  std::mt19937_64 random(test::seed());
  int forged = 0, honest = 0, lost = 0;
  std::int64_t slowest_ns = 0;
  for (int round = 0; round < 2000; ++round) {
    const Forgery result = forge(random, round % 2 == 0);
    ASSERT_EQ(result.forgedUnflagged, 0) << round;
    ASSERT_GT(result.alarm_ns, 0) << round << ": no alarm";
    slowest_ns = std::max(slowest_ns, result.alarm_ns);
    forged += result.forgedPublished;
    honest += result.honest;
    lost += result.honest - result.honestPublished;
  }
  std::printf(
      "  forged pictures published unflagged: 0; flagged: %d; the camera's not used: %d of %d; slowest alarm %.2f s\n",
      forged, lost, honest, 1e-9 * static_cast<double>(slowest_ns));
  EXPECT_LT(slowest_ns, 1'000'000'000);
}

TEST_F(FrameGateTest, FlagsFiveFramesOfACameraThatCountsAnew) {
  SimulatedCamera camera(40'000);
  stream(camera, 100);
  camera.count(7);
  expectFiveDoubted(camera);
  EXPECT_EQ(ledger_.doubted.get(), 5U);
}

/// Whether that was the camera's or another host's is not known, nor how fast it would have counted.
TEST_F(FrameGateTest, FlagsFiveFramesOfACounterThatReplacesASinglePicture) {
  SimulatedCamera camera(40'000);
  Arrival first = camera.take();
  first.id = 7;
  EXPECT_EQ(judge(first).verdict, Verdict::kNew);
  expectFiveDoubted(camera);
}

/// The first pictures wait while a camera is opened, and come at once: the host's mean time between frames is too short
/// then. Another host's picture comes early in the place of the camera's next, which the driver throws away.
TEST_F(FrameGateTest, DoubtsAnEarlyPictureAfterPicturesThatWaited) {
  std::mt19937 random(test::seed());
  for (int i = 0; i < 400; ++i) {
    FrameGate gate(kShape, {});
    SimulatedCamera camera(1 + random() % 60'000);
    std::int64_t free_ns = camera.hostNow() + static_cast<std::int64_t>(random() % 6) * kPeriod_ns;  // the host
    const bool isLossy = random() % 2 == 0;
    for (int k = 0, frames = 18 + static_cast<int>(random() % 60); k < frames; ++k) {
      if (isLossy && random() % 2 == 0) camera.lose(1);
      Arrival honest = camera.take();
      honest.host_ns = std::max(honest.host_ns + static_cast<std::int64_t>(random() % 1'000'000), free_ns);
      free_ns = honest.host_ns;
      ASSERT_FALSE(gate.judge(honest).doubted) << i << ", " << k;
    }
    Arrival forged = camera.take();
    const std::int64_t sooner_ns = 7'000'000 + static_cast<std::int64_t>(random() % 2'000'000);
    forged.host_ns -= sooner_ns;
    if (random() % 3 == 0) forged.device_ns -= sooner_ns;
    const bool isDoubted = gate.judge(forged).doubted;
    Arrival next = camera.take();
    next.host_ns += static_cast<std::int64_t>(random() % 1'000'000);
    next.thrown = 1;
    next.late = 1.0;
    const Judgement judgement = gate.judge(next);
    ASSERT_EQ(judgement.verdict, Verdict::kNew);
    EXPECT_TRUE(isDoubted || judgement.doubted) << i << (isLossy ? ", lossy" : "");
  }
}

/// The first two frames came at once, as after a camera has been opened: they say little of the time between frames, of
/// which it is told whether a frame that came too late was a lost one.
TEST_F(FrameGateTest, DoubtsASecondSenderSoonAfterTheStart) {
  SimulatedCamera camera(40'000);
  Arrival first = camera.take();
  first.host_ns += kPeriod_ns - 1'000'000;
  EXPECT_EQ(judge(first).verdict, Verdict::kNew);
  stream(camera, 20);
  Arrival forged = camera.take();
  forged.host_ns -= kPeriod_ns / 2;
  EXPECT_EQ(judge(forged).verdict, Verdict::kNew);
  Arrival next = camera.take();
  next.thrown = 1;  // the camera's own
  next.late = 1.0;
  const Judgement judgement = judge(next);
  EXPECT_EQ(judgement.verdict, Verdict::kNew);
  EXPECT_TRUE(judgement.outnumbered);
}

}  // namespace
}  // namespace tractiond::capture::frame_gate_doubt_test
