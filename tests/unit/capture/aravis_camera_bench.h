// A camera driver, and Aravis's own GigE Vision camera that it opens, over a loopback of their own.
#pragma once

#include "base/clock.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "tests/unit/capture/fake_camera.h"

#include <arv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <memory>

namespace tractiond::capture::aravis_camera_test {

using std::chrono::milliseconds;
using test::FakeCamera;

class AravisCameraTest : public testing::Test {
 protected:
  AravisCameraTest() {
    options_.wait = false;
    options_.receiveBuffer_bytes = 2 << 20;
  }

  tl::expected<std::unique_ptr<Camera>, Error> openWith(Ledger& ledger, const Say& say = {}) {
    return Camera::open(
        fromAravis(options_),
        {.wait = options_.wait, .silenceTimeout_ms = options_.silenceTimeout_ms, .buffers = options_.buffers}, ledger,
        say);
  }
  void open() {
    auto opened = openWith(ledger_);
    ASSERT_TRUE(opened) << opened.error().message();
    camera_ = std::move(*opened);
  }
  Error openFails() {
    auto opened = openWith(ledger_);
    EXPECT_FALSE(opened);
    return opened ? Error{} : opened.error();
  }
  /// The next picture that is used; fails the test after five seconds.
  void frame(Frame& frame) {
    const std::int64_t until_ns = monotonicNow() + 5'000'000'000;
    while (monotonicNow() < until_ns)
      if (camera_->next(frame, milliseconds(100)) == Next::kFrame) return;
    FAIL() << "no frame";
  }
  static std::uint64_t painted(const Frame& frame) {
    std::uint64_t count = 0;
    std::memcpy(&count, frame.data, sizeof count);
    return count;
  }
  /// Uses `frames` pictures and expects each to be newer than the last.
  void stream(int frames) {
    for (int i = 0; i < frames; ++i) {
      Frame one;
      ASSERT_NO_FATAL_FAILURE(frame(one));
      ASSERT_GT(painted(one), lastPainted_);
      ASSERT_GT(one.info.frameNumber, lastNumber_);
      ASSERT_GE(one.info.times.captured_ns, lastCaptured_ns_);
      ASSERT_LE(one.info.times.captured_ns, one.info.times.received_ns);
      lastPainted_ = painted(one);
      lastNumber_ = one.info.frameNumber;
      lastCaptured_ns_ = one.info.times.captured_ns;
      lastId_ = one.info.cameraFrameId;
      camera_->recycle(one);
    }
  }

  FakeCamera& fake(const FakeCamera::Options& options = {}) {
    fake_.reset();
    fake_ = std::make_unique<FakeCamera>(options);
    return *fake_;
  }

  CameraOptions options_;
  Ledger ledger_;
  std::unique_ptr<FakeCamera> fake_;
  std::unique_ptr<Camera> camera_;
  std::uint64_t lastPainted_ = 0, lastNumber_ = 0, lastId_ = 0;
  std::int64_t lastCaptured_ns_ = 0;
};

}  // namespace tractiond::capture::aravis_camera_test
