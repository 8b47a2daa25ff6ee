// A camera of the test's on the wire, and what tractiond makes of it.
#pragma once

#include "daemon/base/clock.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "tests/unit/capture/gv_transmitter.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdio>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace tractiond::capture {

inline constexpr int kWidth = 64, kHeight = 48;
inline constexpr std::uint32_t kRgb8Code = 0x02180014;
inline constexpr std::size_t kPicture_bytes = std::size_t{kWidth} * kHeight * 3;

class Quirks : public testing::Test {
 protected:
  explicit Quirks(const std::string& description = DESCRIPTIONS "/quirky.xml")
      : sender_(description) {
    options_.id = "127.0.0.1";
    options_.wait = false;
    options_.receiveBuffer_bytes = 2 << 20;
    options_.packetSize_bytes = 1500;
    options_.buffers = 30;
    sender_.write(0x100, kWidth);
    sender_.write(0x104, kHeight);
    sender_.write(0x128, kRgb8Code);
    std::printf("seed %llu\n", static_cast<unsigned long long>(seed_));
  }
  void open() {
    auto camera = Camera::open(fromAravis(options_), {.wait = false, .silenceTimeout_ms = options_.silenceTimeout_ms},
                               ledger_, [this](Weight, const std::string& line) { said_.push_back(line); });
    ASSERT_TRUE(camera) << camera.error().message();
    camera_ = *std::move(camera);
  }
  Error openFails() {
    auto camera = Camera::open(fromAravis(options_), {.wait = false}, ledger_);
    EXPECT_FALSE(camera);
    return camera ? Error{} : camera.error();
  }
  /// While the driver waits for its first whole frame, pictures must flow. They are none of those that are counted.
  void openStreaming() {
    std::atomic<bool> open{false};
    std::thread prelude([&] {
      for (; !open; ++nextId_) {
        if (sender_.streaming()) sender_.send(picture(nextId_, 1));
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
    this->open();
    open = true;
    prelude.join();
    Frame frame;  // what is left of the prelude
    while (camera_ && camera_->next(frame, std::chrono::milliseconds(50)) != Next::kTimeout)
      if (frame.token != nullptr) camera_->recycle(frame);
    preludeReceived_ = ledger_.received.get();
    preludeLosses_ = ledger_.losses();
  }
  test::GvTransmitter::Picture picture(std::uint16_t id, std::uint64_t number) {
    test::GvTransmitter::Picture picture{
        .id = id, .width = kWidth, .height = kHeight, .format = kRgb8Code, .bytes = {}};
    picture.bytes.resize(kPicture_bytes);
    for (auto& byte : picture.bytes) byte = static_cast<std::uint8_t>(random_());
    std::memcpy(picture.bytes.data(), &number, sizeof number);
    return picture;
  }

  const std::uint64_t seed_ = std::random_device{}();
  std::mt19937_64 random_{seed_};
  test::GvTransmitter sender_;
  CameraOptions options_;
  Ledger ledger_;
  std::vector<std::string> said_;
  std::unique_ptr<Camera> camera_;
  std::uint16_t nextId_ = 60'000;  ///< what follows the prelude, of which some may have been left
  std::uint64_t preludeReceived_ = 0, preludeLosses_ = 0;
};

}  // namespace tractiond::capture
