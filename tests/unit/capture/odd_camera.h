// A camera with a driver of the test's choice.
#pragma once

#include "base/clock.h"
#include "daemon/capture/camera.h"
#include "tests/support/deadline.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <deque>
#include <mutex>
#include <thread>

namespace tractiond::capture::odd_camera_test {

using std::chrono::milliseconds;

/// The camera's time, which passes only when a test says so [ns].
inline std::atomic<std::int64_t> virtual_ns{1'000'000'000};
inline std::int64_t virtualNow() {
  return virtual_ns;
}

/// What the test tells the driver to do next, shared with it.
struct Script {
  std::mutex mutex;
  std::deque<Popped> pops;
  CameraInfo info;
  bool isSmaller = false;        // its pictures lack a row
  std::atomic<int> sessions{0};  // counted by the camera's thread
  int alive = 0, discarded = 0, given = 0;
  std::optional<Error> refusal;
  std::atomic<bool> answers{true};
  std::atomic<int> doubts{0};  // how often it was asked whether it is there
  std::int64_t (*clock)() = monotonicNow;
  std::atomic<int> asked{0};                                // to open it
  std::atomic<bool> hangs{false};                           // while it is opened
  std::atomic<bool> callsHang{false}, isCalled{false};      // serve() and link(), as Aravis's do of a dead camera
  std::atomic<bool> readsSlowly{false}, isWelcomed{false};  // the welcome of a later session waits for a disk
  std::uint64_t id = 0;
  FrameExtras extras;
};

class ScriptedDriver : public Driver {
 public:
  explicit ScriptedDriver(Script& script)
      : script_(script)
      , info_(script.info) {
    ++script_.alive;
  }
  ~ScriptedDriver() override {
    const std::lock_guard lock(script_.mutex);
    --script_.alive;
  }
  const CameraInfo& info() const override { return info_; }
  Popped pop(Buffer& buffer, milliseconds timeout) override {
    std::unique_lock lock(script_.mutex);
    if (script_.pops.empty()) {
      lock.unlock();
      std::this_thread::sleep_for(std::min(timeout, milliseconds(5)));
      return Popped::kNothing;
    }
    const Popped popped = script_.pops.front();
    script_.pops.pop_front();
    if (popped != Popped::kBuffer) return popped;
    buffer.arrival = {
        .complete = true, .shape = info_.shape, .id = ++script_.id, .device_ns = 0, .host_ns = script_.clock()};
    if (script_.isSmaller) --buffer.arrival.shape.height;
    picture_[0] = static_cast<std::uint8_t>(script_.id);
    buffer.data = picture_.data();
    buffer.extras = script_.extras;
    buffer.handle = &script_;
    return Popped::kBuffer;
  }
  std::string doubt() override {
    const bool answers = script_.answers;
    ++script_.doubts;
    return answers ? "" : "it does not answer";
  }
  std::string objection() const override { return "sends pictures that lack a row"; }
  void giveBack(void*) override { ++script_.given; }
  Discard discard() const override {
    return [](void* script) { ++static_cast<Script*>(script)->discarded; };
  }
  tl::expected<CameraReport, std::string> serve(const CameraStep& step) override {
    hang();
    return CameraReport{.remarks = {step.name}};
  }
  CameraLink link(const CameraLink& /*before*/) override {
    hang();
    return {};
  }

 private:
  void hang() {
    if (!script_.callsHang) return;
    script_.isCalled = true;
    script_.callsHang.wait(true);
  }

  Script& script_;
  CameraInfo info_;
  std::array<std::uint8_t, 600> picture_{};
};

class OddCamera : public testing::Test {
 protected:
  OddCamera() {
    script_.info.name.id = "Odd";
    script_.info.shape = {20, 30, 600, 1};
  }
  ~OddCamera() override {
    camera_.reset();
    expectNoneAlive();
  }
  void expectNoneAlive() {
    EXPECT_TRUE(test::eventually([this] {  // it is closed elsewhere
      std::this_thread::sleep_for(milliseconds(1));
      return alive() == 0;
    }));
  }
  int alive() {
    const std::lock_guard lock(script_.mutex);
    return script_.alive;
  }
  void open(CameraRules rules = {.silenceTimeout_ms = 0}) {
    script_.clock = rules.clock;
    auto camera = Camera::open(
        [this](const Opening&) -> tl::expected<std::unique_ptr<Driver>, Error> {
          ++script_.asked;
          while (script_.hangs) std::this_thread::sleep_for(milliseconds(1));
          const std::lock_guard lock(script_.mutex);
          ++script_.sessions;
          if (script_.refusal) return tl::unexpected(*script_.refusal);
          return std::make_unique<ScriptedDriver>(script_);
        },
        rules, ledger_,
        [this](LogLevel, const std::string& line) {
          const std::lock_guard lock(script_.mutex);
          said_.push_back(line);
        },
        [this](const CameraInfo& info) -> tl::expected<void, Error> {
          if (info.session > 1) script_.isWelcomed = true;
          if (info.session > 1) script_.readsSlowly.wait(true);
          const std::lock_guard lock(script_.mutex);
          welcomed_.push_back(info.session);
          return {};
        });
    ASSERT_TRUE(camera) << camera.error().message();
    camera_ = *std::move(camera);
  }
  void tell(std::initializer_list<Popped> pops) {
    const std::lock_guard lock(script_.mutex);
    script_.pops.insert(script_.pops.end(), pops);
  }
  Next nextOtherThan(Next dull, Frame& frame) {
    Next next = dull;
    EXPECT_TRUE(test::eventually([&] {
      next = camera_->next(frame, milliseconds(20));
      return next != dull;
    }));
    return next;
  }

  std::vector<std::string> said() {
    const std::lock_guard lock(script_.mutex);
    return said_;
  }
  std::vector<unsigned> welcomed() {
    const std::lock_guard lock(script_.mutex);
    return welcomed_;
  }

  Script script_;
  Ledger ledger_;
  std::vector<std::string> said_;
  std::vector<unsigned> welcomed_;
  std::unique_ptr<Camera> camera_;
};

}  // namespace tractiond::capture::odd_camera_test
