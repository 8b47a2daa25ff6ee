// When was the picture taken? Real packets, and the camera's clock is set meanwhile.
#include "base/clock.h"
#include "tests/unit/capture/quirks.h"
#include "tests/unit/capture/quirky.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>

namespace tractiond::capture::capture_time_test {
namespace {

using std::chrono::milliseconds;
using test::GvTransmitter;

/// The same camera, and it latches its clock.
std::string withLatch() {
  std::string text = quirky();
  text.insert(text.find("<Port Name=\"Device\"/>"), R"(
    <Command Name="GevTimestampControlLatch"><pValue>LatchReg</pValue><CommandValue>2</CommandValue></Command>
    <IntReg Name="LatchReg"><Address>0x944</Address><Length>4</Length><AccessMode>WO</AccessMode><pPort>Device</pPort>
      <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
  )");
  const std::string path = testing::TempDir() + "latch-" + std::to_string(getpid()) + ".xml";
  std::ofstream(path) << text;
  return path;
}

class Timed : public Quirks {
 protected:
  explicit Timed(const std::string& description = quirkyFile())
      : Quirks(description) {}

  /// Streams pictures of a camera whose clock is off and set to another time halfway; each must have been taken when it
  /// is said to have been. Returns how many were dated from both sides.
  int dated(const char* what) {
    constexpr int kFrames = 600;
    sender_.clockRate = std::uniform_real_distribution<double>(-500e-6, 500e-6)(random_);
    EXPECT_NO_FATAL_FAILURE(openStreaming());
    for (int i = 0; i < kFrames && !HasFatalFailure(); ++i) {
      if (i % (kFrames / 2) == 0) sender_.setClock(static_cast<std::int64_t>(random_() % 1'000'000'000'000'000));
      send();
      while (use(milliseconds(4))) {
      }
    }
    while (use(milliseconds(100))) {
    }
    std::printf("  %-18s of %d frames %d dated, %d from both sides, stated true %d\n", what, kFrames, frames_, both_,
                stated_);
    EXPECT_GE(frames_, kFrames * 9 / 10);  // a machine that stands still loses some
    EXPECT_GE(stated_, frames_ * 99 / 100);
    return both_;
  }

  int frames_ = 0, both_ = 0, stated_ = 0;

 private:
  void send() {
    GvTransmitter::Picture one = picture(nextId_, nextId_);
    std::int64_t before_ns = 0, after_ns = 0;
    do {
      before_ns = monotonicNow();
      one.device_ticks = sender_.ticks();
      after_ns = monotonicNow();
    } while (after_ns - before_ns > 3000);
    truths_[nextId_++] = (before_ns + after_ns) / 2;
    std::this_thread::sleep_for(std::chrono::microseconds(random_() % 3000));
    sender_.send(one);
  }

  bool use(milliseconds timeout) {
    Frame frame;
    if (next(frame, timeout) != Next::kFrame) return false;
    const FrameTimes& times = frame.info.times;
    const std::int64_t off_ns = times.captured_ns - truths_.at(frame.info.cameraFrameId);
    const bool both = times.capturedBound == CaptureBound::kBoth;
    EXPECT_LE(times.captured_ns, times.received_ns);
    EXPECT_GE(times.captured_ns, last_ns_);
    last_ns_ = times.captured_ns;
    ++frames_;
    both_ += both ? 1 : 0;
    stated_ += -off_ns <= times.capturedError_ns && (!both || off_ns <= times.capturedError_ns) ? 1 : 0;
    camera_->recycle(frame);
    return true;
  }

  std::map<std::uint64_t, std::int64_t> truths_;
  std::int64_t last_ns_ = 0;
};

class Latching : public Timed {
 protected:
  Latching()
      : Timed(withLatch()) {}
};

TEST_F(Latching, EveryFrameIsDatedFromBothSides) {
  // Of a clock that was set the gate believes nothing for a hundred frames; nor after pictures without a stamp, the
  // first.
  EXPECT_GE(dated("latches its clock") + 250, frames_);
}

TEST_F(Timed, OneSideIsTrueOfACameraThatCannotBeAsked) {
  EXPECT_EQ(dated("does not latch"), 0);
}

TEST_F(Timed, OneSideIsTrueOfACameraThatAravisDatesByTheTimeOfDay) {
  sender_.write(0x0940, 0);
  EXPECT_EQ(dated("has no clock"), 0);
}

/// As it answers no more while its clock is asked: the frames do not wait for it, and its end is noticed all the same.
TEST_F(Latching, ACameraThatHangsWhileItIsAskedHoldsUpNothing) {
  sender_.setClock(1'000'000'000);
  options_.silenceTimeout_ms = 400;
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  sender_.hangsAt = 0x0944;
  Frame frame;
  std::int64_t longest_ns = 0;
  for (int i = 0; i < 60; ++i) {
    GvTransmitter::Picture one = picture(nextId_, nextId_);
    ++nextId_;
    one.device_ticks = sender_.ticks();
    sender_.send(one);
    const std::int64_t before_ns = monotonicNow();
    ASSERT_EQ(next(frame, milliseconds(1000)), Next::kFrame);
    longest_ns = std::max(longest_ns, monotonicNow() - before_ns);
    EXPECT_EQ(frame.info.times.capturedBound, CaptureBound::kBoth);
    camera_->recycle(frame);
    std::this_thread::sleep_for(milliseconds(8));
  }
  EXPECT_LT(longest_ns, 300'000'000);
  const std::int64_t silent_ns = monotonicNow();
  while (camera_->state() == CameraState::kStreaming && monotonicNow() - silent_ns < 5'000'000'000)
    next(frame, milliseconds(20));
  std::printf("noticed after %.0f ms\n", static_cast<double>(monotonicNow() - silent_ns) * 1e-6);
  EXPECT_LT(monotonicNow() - silent_ns, 1'000'000'000);
}

}  // namespace
}  // namespace tractiond::capture::capture_time_test
