// A camera of the test's on the wire, and what tractiond makes of it.
#pragma once

#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "tests/support/seed.h"
#include "tests/unit/capture/gv_transmitter.h"
#include "tests/unit/capture/quirky.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace tractiond::capture {

inline constexpr int kWidth = 64, kHeight = 48;
inline constexpr std::uint32_t kRgb8Code = 0x02180014;
inline constexpr std::size_t kPicture_bytes = std::size_t{kWidth} * kHeight * 3;

/// Appends a big-endian number.
inline void append(std::vector<std::uint8_t>& bytes, std::uint64_t value, int size) {
  for (int shift = 8 * (size - 1); shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}
/// Appends a chunk with one number.
inline void appendChunk(std::vector<std::uint8_t>& bytes, std::uint32_t id, std::uint64_t value, int size) {
  append(bytes, value, size);
  append(bytes, id, 4);
  append(bytes, static_cast<std::uint64_t>(size), 4);
}

class Quirks : public testing::Test {
 protected:
  explicit Quirks(const std::string& description = quirkyFile())
      : sender_(description) {
    options_.id = "127.0.0.1";
    options_.wait = false;
    options_.receiveBuffer_bytes = 2 << 20;
    options_.packetSize_bytes = 1500;
    options_.buffers = 30;
    sender_.write(0x100, kWidth);
    sender_.write(0x104, kHeight);
    sender_.write(0x128, kRgb8Code);
  }
  void open() {
    auto camera = Camera::open(fromAravis(options_), {.wait = false, .silenceTimeout_ms = options_.silenceTimeout_ms},
                               ledger_, [this](LogLevel, const std::string& line) {
                                 const std::lock_guard lock(saidMutex_);
                                 said_.push_back(line);
                               });
    ASSERT_TRUE(camera) << camera.error().message();
    camera_ = *std::move(camera);
  }
  Error openFails() {
    auto camera = Camera::open(fromAravis(options_), {.wait = false}, ledger_);
    EXPECT_FALSE(camera);
    return camera ? Error{} : camera.error();
  }
  /// While the driver waits for its first whole frame, pictures must flow. They are none of those that are counted,
  /// which come after them as any camera's do.
  void openStreaming() {
    std::atomic<bool> open{false};
    std::thread prelude([&] {
      for (; !open; std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
        if (sender_.streaming()) sender_.send(taken(0));
      }
    });
    this->open();
    open = true;
    prelude.join();
    Frame frame;  // what is left of the prelude
    while (camera_ && camera_->next(frame, std::chrono::milliseconds(50)) != Next::kTimeout)
      if (frame.token != nullptr) camera_->recycle(frame);
  }
  /// Every line so far, from whichever thread.
  std::vector<std::string> said() {
    const std::lock_guard lock(saidMutex_);
    return said_;
  }
  /// As the camera's, without what was left of the prelude.
  Next next(Frame& frame, std::chrono::milliseconds timeout) {
    for (;;) {
      const Next next = camera_->next(frame, timeout);
      std::uint64_t number = 1;
      if (next == Next::kFrame) std::memcpy(&number, frame.data, sizeof number);
      if (number != 0) return next;
      camera_->recycle(frame);
    }
  }
  /// The camera's next, without a time.
  test::GvTransmitter::Picture taken(std::uint64_t number) {
    test::GvTransmitter::Picture one = picture(nextId_, number);
    nextId_ = nextId_ == 65'535 ? 1 : static_cast<std::uint16_t>(nextId_ + 1);
    return one;
  }
  test::GvTransmitter::Picture picture(std::uint16_t id, std::uint64_t number) {
    test::GvTransmitter::Picture picture{
        .id = id, .width = width_, .height = height_, .format = kRgb8Code, .bytes = {}};
    picture.bytes.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_) * 3);
    for (auto& byte : picture.bytes) byte = static_cast<std::uint8_t>(random_());
    std::memcpy(picture.bytes.data(), &number, sizeof number);
    return picture;
  }

  std::mt19937_64 random_{test::seed()};  ///< the sender's has the next seed
  test::GvTransmitter sender_;
  CameraOptions options_;
  Ledger ledger_;
  std::mutex saidMutex_;
  std::vector<std::string> said_;
  std::unique_ptr<Camera> camera_;
  int width_ = kWidth, height_ = kHeight;
  std::uint16_t nextId_ = 60'000;
};

}  // namespace tractiond::capture
