// Cameras as they are, on the wire: clocks that are none, chunk data, short counters, settings that undo each other.
#include "base/clock.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "tests/unit/capture/quirks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cstring>
#include <random>
#include <set>
#include <thread>

namespace tractiond::capture::quirks_test {
namespace {

using std::chrono::milliseconds;
using test::GvTransmitter;
using testing::Contains;
using testing::HasSubstr;

/// Without a clock, with one chunk that nobody knows, and while the ids of 16 bits begin again.
TEST_F(Quirks, AllAtOnceLoseAndDoubleNothing) {
  constexpr std::size_t kBehind_bytes = 312;
  constexpr std::uint64_t kFrames = 600;
  sender_.write(0x1f4, kBehind_bytes);
  nextId_ = 65'100;
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  std::set<std::uint64_t> seen;
  const auto use = [&](milliseconds timeout) {
    Frame frame;
    const Next next = this->next(frame, timeout);
    if (next != Next::kFrame) return next;
    std::uint64_t number = 0;
    std::memcpy(&number, frame.data, sizeof number);
    EXPECT_TRUE(seen.insert(number).second) << "it came twice";
    EXPECT_EQ(frame.size, kPicture_bytes);
    EXPECT_LE(frame.info.times.captured_ns, frame.info.times.received_ns);
    EXPECT_GT(frame.info.times.capturedError_ns, 0);
    camera_->recycle(frame);
    return next;
  };
  for (std::uint64_t i = 1; i <= kFrames; ++i) {
    GvTransmitter::Picture one = taken(i);
    one.payloadType = 0x4001;
    one.bytes.resize(kPicture_bytes + kBehind_bytes);
    const std::uint32_t tail[2] = {__builtin_bswap32(0x7777U), __builtin_bswap32(kBehind_bytes - 8)};
    std::memcpy(one.bytes.data() + one.bytes.size() - 8, tail, 8);
    sender_.send(one);
    std::this_thread::sleep_for(std::chrono::microseconds(1500));
    use(milliseconds(20));
  }
  while (use(milliseconds(100)) != Next::kTimeout) {
  }
  EXPECT_EQ(seen.size(), kFrames);
  EXPECT_EQ(ledger_.doubted.get(), 0U);
}

// ---------------------------------------------------------------- who sends

TEST_F(Quirks, ACameraThatNamesAnotherPortIsHeardAllTheSame) {
  sender_.write(0x0d1c, 5);
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  EXPECT_THAT(said(), Contains(HasSubstr("does not send from the port that it says it does")));
  sender_.send(picture(nextId_, 1));
  Frame frame;
  ASSERT_EQ(next(frame, milliseconds(1000)), Next::kFrame);
  camera_->recycle(frame);
}

// ---------------------------------------------------------------- chunks

TEST_F(Quirks, ChunksTellWhatTheFrameWasTakenWith) {
  sender_.write(0x1f4, 16 + 12 + 12 + 16);
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  for (int i = 0; i < 50; ++i) {
    const double exposure_us = 10.0 + static_cast<double>(random_() % 100'000);
    const auto gain = static_cast<float>(random_() % 40);
    const auto lines = static_cast<std::uint32_t>(random_() % 16);
    const auto taken_ns = 8 * (random_() % (1ULL << 50));  // the leader knows no time, and the chunk counts in 8 ns
    GvTransmitter::Picture one = taken(1000 + static_cast<std::uint64_t>(i));
    one.payloadType = 0x4001;
    appendChunk(one.bytes, 0x1001, std::bit_cast<std::uint64_t>(exposure_us), 8);
    appendChunk(one.bytes, 0x1002, __builtin_bswap32(std::bit_cast<std::uint32_t>(gain)), 4);
    appendChunk(one.bytes, 0x1004, lines, 4);
    appendChunk(one.bytes, 0x1005, taken_ns / 8, 8);
    sender_.send(one);
    Frame frame;
    ASSERT_EQ(next(frame, milliseconds(1000)), Next::kFrame);
    EXPECT_NEAR(frame.info.exposure_s, exposure_us * 1e-6, 1e-12);
    EXPECT_EQ(frame.info.extras.gain, gain);
    EXPECT_EQ(frame.info.extras.lines, lines);
    EXPECT_EQ(static_cast<std::uint64_t>(frame.info.times.device_ns), taken_ns);
    camera_->recycle(frame);
  }
}

// ---------------------------------------------------------------- settings

TEST_F(Quirks, SelectorsAreSetAgainAndAgain) {
  options_.features = {{"UserSetSelector", std::string("Default")},   {"UserSetLoad", true},
                       {"BalanceRatioSelector", std::string("Red")},  {"BalanceRatio", std::int64_t{100}},
                       {"BalanceRatioSelector", std::string("Blue")}, {"BalanceRatio", std::int64_t{200}}};
  options_.gain = 7;  // after the user set that undoes it
  sender_.commandTakes_ms = 150;
  sender_.write(0x110, 3);
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_EQ(sender_.read(0x210), 100U);
  EXPECT_EQ(sender_.read(0x214), 200U);
  EXPECT_EQ(sender_.read(0x110), 7U);
  EXPECT_EQ(sender_.read(0x224), 0U) << "the load was waited for";
  EXPECT_THAT(camera_->info()->settings, Contains("UserSetLoad executed"));
}

/// Whatever stood before, any region that fits the sensor can be had.
TEST_F(Quirks, AnyRegionFollowsAnyOther) {
  for (int round = 0; round < 12; ++round) {
    const auto upTo = [&](int most) { return static_cast<int>(random_() % static_cast<std::uint64_t>(most + 1)); };
    options_.width = 64 + 4 * upTo(496);
    options_.height = 48 + upTo(2000);
    options_.offsetX = upTo(1) == 0 ? -1 : upTo(2048 - options_.width);
    options_.offsetY = upTo(1) == 0 ? -1 : upTo(2048 - options_.height);
    options_.pixelFormat = "BayerRG8";
    ASSERT_NO_FATAL_FAILURE(open());
    EXPECT_EQ(sender_.read(0x100), static_cast<std::uint32_t>(options_.width));
    EXPECT_EQ(sender_.read(0x104), static_cast<std::uint32_t>(options_.height));
    if (options_.offsetX >= 0) {
      EXPECT_EQ(sender_.read(0x130), static_cast<std::uint32_t>(options_.offsetX));
    }
    EXPECT_LE(sender_.read(0x130) + sender_.read(0x100), 2048U);
    EXPECT_LE(sender_.read(0x134) + sender_.read(0x104), 2048U);
    camera_.reset();
  }
}

TEST_F(Quirks, ACameraThatForgotIsSetAsItWas) {
  sender_.write(0x1f8, 500);  // 5 ms
  sender_.write(0x110, 12);
  options_.silenceTimeout_ms = 200;
  ASSERT_NO_FATAL_FAILURE(open());
  EXPECT_NEAR(camera_->info()->exposure_s, 5e-3, 1e-9);
  // Its power goes and comes back: factory values.
  sender_.write(0x1f8, 2000);
  sender_.write(0x110, 0);
  sender_.write(0x100, 2048);
  Frame frame;
  const std::int64_t until_ns = monotonicNow() + 20'000'000'000;
  while (camera_->info()->session < 2 && monotonicNow() < until_ns) next(frame, milliseconds(20));
  EXPECT_EQ(sender_.read(0x1f8), 500U);
  EXPECT_EQ(sender_.read(0x110), 12U);
  EXPECT_EQ(sender_.read(0x100), static_cast<std::uint32_t>(kWidth));
  EXPECT_NEAR(camera_->info()->exposure_s, 5e-3, 1e-9);
  EXPECT_THAT(said(), Contains(HasSubstr("came back with exposure_us = 20000; set to 5000 us again")));
  EXPECT_THAT(said(), Contains(HasSubstr("came back with gain = 0; set to 12 again")));
}

/// Denied, or acknowledged and not made: while it streams, and when it is opened.
TEST_F(Quirks, AWriteThatChangesNothingIsNoSuccess) {
  sender_.write(0x1f8, 500);  // 5 ms
  sender_.write(0x110, 12);
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  const auto set = [this](const char* name, const char* value) {
    CameraStep step;
    step.mutable_write()->set_name(name);
    step.mutable_write()->set_value(value);
    camera_->ask(step);
    for (Frame frame;;) {
      if (const auto answer = camera_->takeAnswer()) return *answer ? std::string("done") : answer->error();
      if (camera_->next(frame, milliseconds(5)) == Next::kFrame) camera_->recycle(frame);
    }
  };
  EXPECT_EQ(set("Gain", "11"), "done");
  for (auto* const fault : {&sender_.locksAt, &sender_.ignoresAt}) {
    *fault = 0x110;
    const std::string gain = set("Gain", "10");
    EXPECT_THAT(gain, HasSubstr(fault == &sender_.locksAt ? "access-denied" : "still says")) << gain;
    EXPECT_THAT(gain, HasSubstr("Gain = 1"));
    *fault = 0x1f8;
    const std::string exposure = set("ExposureTime", "2000");
    EXPECT_THAT(exposure, HasSubstr(fault == &sender_.locksAt ? "refuses" : "still says ExposureTime = 5000"))
        << exposure;
    *fault = 0;
  }
  std::cout
      << "  the camera denies a write while it streams, or acknowledges it and does nothing: a refusal that says so; "
         "right: a refusal\n";
  camera_.reset();
  options_.exposure_us = 2000;
  sender_.ignoresAt = 0x1f8;
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  EXPECT_THAT(camera_->info()->warnings, Contains(HasSubstr("made 5000 us of camera.exposure_us = 2000")));
}

TEST_F(Quirks, NoAnswerIsNoRefusal) {
  options_.features = {{"Gain", std::int64_t{31}}, {"BalanceRatio", std::int64_t{5}}};
  for (const std::uint32_t address : {0x110U, 0x210U}) {
    sender_.hangsAt = address;
    const Error error = openFails();
    EXPECT_EQ(error.exitCode, EX_UNAVAILABLE) << error.message();
    EXPECT_THAT(error.message(), HasSubstr("does not answer"));
  }
}

}  // namespace
}  // namespace tractiond::capture::quirks_test
