// When was the picture taken? Real packets, and clocks that are set: the camera's, and the time of day.
#include "tests/support/places.h"
#include "tests/support/wall_clock.h"
#include "tests/unit/capture/quirks.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>

namespace tractiond::capture::capture_time_test {
namespace {

using std::chrono::milliseconds;
using test::GvTransmitter;

/// The same camera, and it latches its clock.
std::string withLatch() {
  std::ifstream in(test::source("tests/unit/capture/descriptions/quirky.xml"));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  text.insert(text.find("<Port Name=\"Device\"/>"), R"(
    <Command Name="GevTimestampControlLatch"><pValue>LatchReg</pValue><CommandValue>2</CommandValue></Command>
    <IntReg Name="LatchReg"><Address>0x944</Address><Length>4</Length><AccessMode>WO</AccessMode><pPort>Device</pPort>
      <Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
  )");
  const std::string path = testing::TempDir() + "latch-" + std::to_string(getpid()) + ".xml";
  std::ofstream(path) << text;
  return path;
}

/// The same camera, and its temperature is in a register.
std::string withThermometer() {
  std::ifstream in(test::source("tests/unit/capture/descriptions/quirky.xml"));
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string constant = "<Value>41.5</Value>";
  text.replace(text.find(constant), constant.size(), "<pValue>TemperatureReg</pValue>");
  text.insert(text.find("<Port Name=\"Device\"/>"), R"(
    <IntReg Name="TemperatureReg"><Address>0x1f8</Address><Length>4</Length><AccessMode>RO</AccessMode><pPort>Device</pPort>
      <Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>
  )");
  const std::string path = testing::TempDir() + "thermometer-" + std::to_string(getpid()) + ".xml";
  std::ofstream(path) << text;
  return path;
}

/// Of a frame: when it was really taken, and what is said of that.
struct Dated {
  std::int64_t truth_ns = 0, captured_ns = 0, error_ns = 0, received_ns = 0;
  CaptureBound bound = CaptureBound::kNone;
};

struct Outcome {
  std::size_t frames = 0, both = 0, stated = 0, negative = 0;
};

/// The time of day is set by an hour all the while.
class Timed : public Quirks {
 protected:
  explicit Timed(const std::string& description = test::source("tests/unit/capture/descriptions/quirky.xml"))
      : Quirks(description) {}
  ~Timed() override { test::wallClockAhead_s() = 0; }

  Outcome live(const char* what, std::uint32_t ticksPerSecond) {
    const double rate = std::uniform_real_distribution<double>(-500e-6, 500e-6)(random_);
    sender_.write(0x0940, ticksPerSecond);
    sender_.clockRate = rate;
    sender_.setClock(anyTime());
    openStreaming();
    for (int i = 0; i < kFrames && !HasFatalFailure(); ++i) {
      if (i == kReset) sender_.setClock(anyTime());
      if (i % 100 == 50) test::wallClockAhead_s() += random_() % 2 == 0 ? 3600 : -3600;
      send();
      use(milliseconds(4));
      while (use(milliseconds(0))) {
      }
    }
    while (use(milliseconds(100))) {
    }
    return outcomeOf(what, rate);
  }

  static constexpr int kFrames = 1200, kReset = 600;

 private:
  std::int64_t anyTime() { return static_cast<std::int64_t>(random_() % 1'000'000'000'000'000); }

  void send() {
    const std::uint16_t id = nextId_++;
    GvTransmitter::Picture one = picture(id, id);
    std::int64_t before_ns = 0, after_ns = 0;
    do {
      before_ns = monotonicNow();
      one.device_ticks = sender_.ticks();
      after_ns = monotonicNow();
    } while (after_ns - before_ns > 3000);
    truths_[id] = (before_ns + after_ns) / 2;
    std::this_thread::sleep_for(std::chrono::microseconds(random_() % 3000));
    sender_.send(one);
  }
  bool use(milliseconds timeout) {
    Frame frame;
    if (next(frame, timeout) != Next::kFrame) return false;
    const FrameTimes& times = frame.info.times;
    dated_.push_back({truths_.at(frame.info.cameraFrameId), times.captured_ns, times.capturedError_ns,
                      times.received_ns, times.capturedBound});
    camera_->recycle(frame);
    return true;
  }
  Outcome outcomeOf(const char* what, double rate) const {
    Outcome outcome{.frames = dated_.size()};
    std::vector<double> widths_us{0.0};
    std::int64_t last_ns = 0;
    for (const Dated& one : dated_) {
      outcome.negative += one.captured_ns > one.received_ns || one.captured_ns < last_ns ? 1 : 0;
      last_ns = one.captured_ns;
      const std::int64_t off_ns = one.captured_ns - one.truth_ns;
      const bool both = one.bound == CaptureBound::kBoth;
      outcome.both += both ? 1 : 0;
      outcome.stated += -off_ns <= one.error_ns && (!both || off_ns <= one.error_ns) ? 1 : 0;
      if (both) widths_us.push_back(2e-3 * static_cast<double>(one.error_ns));
    }
    std::sort(widths_us.begin(), widths_us.end());
    std::printf(
        "  %-18s %+4.0f ppm, counter set, wall clock set %d times: of %zu frames both sides of %zu, width p50 %.0f "
        "p99 %.0f us, stated true %zu, negative intervals %zu\n",
        what, rate * 1e6, kFrames / 100, outcome.frames, outcome.both, widths_us[widths_us.size() / 2],
        widths_us[widths_us.size() * 99 / 100], outcome.stated, outcome.negative);
    EXPECT_GE(outcome.frames, kFrames * 9U / 10);  // a machine that stands still loses some
    EXPECT_EQ(outcome.negative, 0U);
    EXPECT_GE(static_cast<double>(outcome.stated), 0.99 * static_cast<double>(outcome.frames));
    return outcome;
  }

  std::map<std::uint64_t, std::int64_t> truths_;
  std::vector<Dated> dated_;
};

class Latching : public Timed {
 protected:
  Latching()
      : Timed(withLatch()) {}
};

TEST_F(Latching, EveryFrameIsDatedFromBothSides) {
  const std::uint32_t frequencies[] = {1'000'000'000, 125'000'000, 33'333'333, 1'000'000};
  const Outcome outcome = live("latches its clock", frequencies[random_() % std::size(frequencies)]);
  // Of a clock that was set the gate believes nothing for a hundred frames; nor after pictures without a stamp, the
  // first.
  EXPECT_GE(outcome.both + 250, outcome.frames);
}

TEST_F(Timed, OneSideIsTrueOfACameraThatCannotBeAsked) {
  EXPECT_EQ(live("does not latch", 1'000'000'000).both, 0U);
}

TEST_F(Timed, OneSideIsTrueOfACameraThatAravisDatesByTheTimeOfDay) {
  EXPECT_EQ(live("has no clock", 0).both, 0U);
}

/// It describes a latch, and has none: what it latches stands still.
TEST_F(Latching, AClockThatStandsStillIsNotBelieved) {
  sender_.write(0x0940, 0);
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  EXPECT_EQ(sender_.read(0x0944), 0U) << "Aravis dates its frames by the host's clock";
  camera_.reset();
  sender_.write(0x0940, 1'000'000'000);
  sender_.clockRate = -1.0;
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  Frame frame;
  for (int i = 0; i < 20; ++i) {
    GvTransmitter::Picture one = picture(nextId_, nextId_);
    ++nextId_;
    one.device_ticks = static_cast<std::uint64_t>(i) * 5'000'000;
    sender_.send(one);
    ASSERT_EQ(next(frame, milliseconds(1000)), Next::kFrame);
    EXPECT_EQ(frame.info.times.capturedBound, CaptureBound::kLatest);
    camera_->recycle(frame);
    std::this_thread::sleep_for(milliseconds(5));
  }
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

class WithThermometer : public Quirks {
 protected:
  WithThermometer()
      : Quirks(withThermometer()) {}
};

/// Aravis repeats the question for three seconds.
TEST_F(WithThermometer, ACameraThatIsGoneWhileItsTemperatureIsReadIsNoticedInTime) {
  options_.silenceTimeout_ms = 400;
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  sender_.hangsAt = 0x1f8;
  Frame frame;
  for (int i = 0; i < 70; ++i) {  // longer than between two looks at the link
    sender_.send(taken(noClock, 1));
    ASSERT_EQ(next(frame, milliseconds(1000)), Next::kFrame);
    camera_->recycle(frame);
    std::this_thread::sleep_for(milliseconds(10));
  }
  const std::int64_t silent_ns = monotonicNow();
  while (camera_->state() == CameraState::kStreaming && monotonicNow() - silent_ns < 5'000'000'000)
    next(frame, milliseconds(20));
  std::printf("noticed after %.0f ms\n", static_cast<double>(monotonicNow() - silent_ns) * 1e-6);
  EXPECT_LT(monotonicNow() - silent_ns, 1'000'000'000);
}

TEST_F(Timed, ACameraWithoutALatchIsNotAsked) {
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  GvTransmitter::Picture one = picture(nextId_, 1);
  one.device_ticks = sender_.ticks();
  sender_.send(one);
  Frame frame;
  ASSERT_EQ(next(frame, milliseconds(1000)), Next::kFrame);
  EXPECT_EQ(frame.info.times.capturedBound, CaptureBound::kLatest);
  camera_->recycle(frame);
  EXPECT_EQ(sender_.read(0x0944), 0U) << "it is asked while it is opened";
}

}  // namespace
}  // namespace tractiond::capture::capture_time_test
