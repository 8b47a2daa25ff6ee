// A camera with a driver of our choice: what the half that is the same for all of them makes of it.
#include "base/clock.h"
#include "daemon/capture/camera.h"
#include "tests/support/deadline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <deque>
#include <mutex>
#include <thread>

namespace tractiond::capture::odd_camera_test {
namespace {

using std::chrono::milliseconds;
using testing::Contains;
using testing::HasSubstr;

/// The camera's time, which passes only when a test says so [ns].
std::atomic<std::int64_t> virtual_ns{1'000'000'000};
std::int64_t virtualNow() {
  return virtual_ns;
}

/// What the test tells the driver to do next, shared with it.
struct Script {
  std::mutex mutex;
  std::deque<Popped> pops;
  CameraInfo info;
  std::atomic<int> sessions{0};  // counted by the camera's thread
  int alive = 0, discarded = 0, given = 0;
  std::optional<Error> refusal;
  std::int64_t (*clock)() = monotonicNow;
  std::atomic<bool> callsHang{false}, isCalled{false};  // serve() and link(), as Aravis's do of a dead camera
  std::uint64_t id = 0;
  bool isFrozen = false;  ///< shows one picture
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
    picture_[0] = static_cast<std::uint8_t>(script_.isFrozen ? 7 : script_.id);
    buffer.data = picture_.data();
    buffer.handle = &script_;
    return Popped::kBuffer;
  }
  void giveBack(void*) override { ++script_.given; }
  Discard discard() const override {
    return [](void* script) { ++static_cast<Script*>(script)->discarded; };
  }
  tl::expected<CameraReport, std::string> serve(const CameraStep& step) override {
    hang();
    CameraReport report;
    report.add_remarks(step.read().name());
    return report;
  }
  CameraLink link(const CameraLink& /*before*/) override {
    hang();
    return {};
  }

 private:
  void hang() {
    if (!script_.callsHang) return;
    script_.isCalled = true;
    script_.isCalled.notify_all();
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
    question_.mutable_read()->set_name("Gain");
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
          const std::lock_guard lock(script_.mutex);
          sessions_.push_back(info.session);
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
  std::vector<unsigned> checked() {
    const std::lock_guard lock(script_.mutex);
    return sessions_;
  }

  CameraStep question_;
  Script script_;
  Ledger ledger_;
  std::vector<std::string> said_;
  std::vector<unsigned> sessions_;
  std::unique_ptr<Camera> camera_;
};

TEST_F(OddCamera, OpensAgainInTheSameWayAndChecksEachSession) {
  open();
  Frame frame;
  tell({Popped::kBuffer, Popped::kGone, Popped::kBuffer});
  ASSERT_EQ(nextOtherThan(Next::kTimeout, frame), Next::kFrame);
  Frame later;
  ASSERT_EQ(nextOtherThan(Next::kTimeout, later), Next::kFrame);
  EXPECT_EQ(script_.sessions, 2);
  EXPECT_EQ(checked(), (std::vector<unsigned>{1, 2}));
  EXPECT_EQ(camera_->info()->session, 2U);
  EXPECT_EQ(ledger_.reconnects.get(), 1U);
  camera_->recycle(frame);  // of the session that is gone
  EXPECT_EQ(script_.discarded, 1);
  camera_->recycle(later);
  EXPECT_EQ(script_.given, 1);
  EXPECT_THAT(said(), Contains(HasSubstr("no longer under our control")));
  camera_.reset();
  EXPECT_EQ(script_.alive, 0);
}

TEST_F(OddCamera, AnswersQuestionsWhileItStreamsAndSaysWhyItCannot) {
  open();
  Frame frame;
  const auto answer = [&] {
    for (;;) {
      camera_->next(frame, milliseconds(5));
      if (auto said = camera_->takeAnswer()) return *said;
    }
  };
  tell({Popped::kBuffer});
  ASSERT_EQ(nextOtherThan(Next::kTimeout, frame), Next::kFrame);
  camera_->recycle(frame);
  camera_->ask(question_);
  EXPECT_EQ(answer()->remarks(0), "Gain");
  {
    const std::lock_guard lock(script_.mutex);
    script_.refusal = Error{.exitCode = EX_UNAVAILABLE, .what = "no camera answers"};
  }
  tell({Popped::kGone});
  while (camera_->state() != CameraState::kLost) camera_->next(frame, milliseconds(5));
  camera_->ask(question_);
  EXPECT_FALSE(answer());
  CameraVitals vitals;
  while (!camera_->takeVitals(vitals)) std::this_thread::yield();
  EXPECT_EQ(vitals.state, CameraState::kLost);
  EXPECT_FALSE(vitals.why.empty());
}

TEST_F(OddCamera, MayBeSilentWhileItWaitsForItsTrigger) {
  script_.info.triggered = true;
  script_.info.trigger = "TriggerMode is On";
  open({.silenceTimeout_ms = 30, .clock = virtualNow});
  Frame frame;
  for (int i = 0; i < 5; ++i) {
    camera_->next(frame, milliseconds(1));
    virtual_ns += 1'000'000'000;
  }
  EXPECT_EQ(script_.sessions, 1);
  CameraVitals vitals;
  ASSERT_TRUE(test::eventually([&] { return camera_->takeVitals(vitals); }));
  EXPECT_EQ(vitals.state, CameraState::kStreaming);
  EXPECT_THAT(vitals.why, HasSubstr("waits for triggers (TriggerMode is On)"));
}

TEST_F(OddCamera, SaysThatItsPicturesRepeatAndThatTheyDoNoMore) {
  open();
  Frame frame;
  CameraVitals vitals;
  const auto says = [&](bool frozen) {
    {
      const std::lock_guard lock(script_.mutex);
      script_.isFrozen = frozen;
    }
    return test::eventually([&] {
      tell({Popped::kBuffer});
      if (camera_->next(frame, milliseconds(5)) == Next::kFrame) camera_->recycle(frame);
      camera_->takeVitals(vitals);
      return vitals.state == CameraState::kStreaming && vitals.repeats == frozen;
    });
  };
  ASSERT_TRUE(says(true));
  EXPECT_THAT(vitals.why, HasSubstr("camera.stills = true"));
  EXPECT_THAT(said(), Contains(HasSubstr("camera Odd: it sends one picture again and again")));
  ASSERT_TRUE(says(false));
  EXPECT_EQ(vitals.why, "");
}

TEST_F(OddCamera, IsLostInTimeWhileACallOfItsDriverHangs) {
  open({.silenceTimeout_ms = 30, .clock = virtualNow});
  Frame frame;
  tell({Popped::kBuffer});
  ASSERT_EQ(nextOtherThan(Next::kTimeout, frame), Next::kFrame);
  camera_->recycle(frame);
  script_.callsHang = true;
  camera_->ask(question_);
  script_.isCalled.wait(false);
  EXPECT_TRUE(test::eventually([&] {
    camera_->next(frame, milliseconds(1));
    virtual_ns += 10'000'000;
    return script_.sessions == 2;
  })) << "it is not opened again";
  EXPECT_THAT(said(), Contains(HasSubstr("fell silent")));
  EXPECT_TRUE(camera_->takeAnswer()) << "who asked is told that it is lost";
  script_.callsHang = false;
  script_.callsHang.notify_all();
  EXPECT_TRUE(test::eventually([&] { return alive() == 1; }));
}

TEST_F(OddCamera, IsOpenedAnewAsItIsToldOrAsBeforeWhereThatIsRefused) {
  open();
  Frame frame;
  const auto streams = [&](unsigned session) {
    tell({Popped::kBuffer});
    while (nextOtherThan(Next::kTimeout, frame) != Next::kFrame) tell({Popped::kBuffer});
    EXPECT_EQ(frame.session, session);
    camera_->recycle(frame);
  };
  const auto opensWith = [&](std::string name, std::optional<Error> refusal, int width = 20) -> OpenDriver {
    return [=, this, tries = 0](const Opening&) mutable -> tl::expected<std::unique_ptr<Driver>, Error> {
      const std::lock_guard lock(script_.mutex);
      if (refusal && (refusal->exitCode != EX_UNAVAILABLE || ++tries < 2)) return tl::unexpected(*refusal);
      script_.info.name.model = name;
      script_.info.shape.width = width;
      return std::make_unique<ScriptedDriver>(script_);
    };
  };
  streams(1);
  camera_->reopen(opensWith("new", {}));
  streams(2);
  EXPECT_EQ(camera_->info()->name.model, "new");
  EXPECT_THAT(said(), testing::Not(Contains(HasSubstr("lost"))));

  camera_->reopen(opensWith("refused", Error{.exitCode = EX_CONFIG, .what = "no such exposure"}));
  streams(3);
  camera_->reopen(opensWith("of another width", {}, 10));
  streams(4);
  EXPECT_EQ(camera_->info()->name.model, "new");
  EXPECT_THAT(said(), Contains(HasSubstr("opened as before: no such exposure")));
  EXPECT_THAT(said(), Contains(HasSubstr("opened as before: camera Odd came back with another picture")));

  camera_->reopen(opensWith("later", Error{.exitCode = EX_UNAVAILABLE, .what = "asleep"}));
  streams(5);
  EXPECT_EQ(camera_->info()->name.model, "later") << "no answer is no refusal";
  EXPECT_EQ(script_.alive, 1);
  EXPECT_EQ(ledger_.reconnects.get(), 4U);
}

TEST_F(OddCamera, MayEndAtAnyMoment) {
  for (int round = 0; round < 30; ++round) {
    script_.pops.clear();
    tell({Popped::kBuffer, Popped::kGone, Popped::kBuffer, Popped::kGone});
    open();
    Frame frame;
    for (int i = 0; i < round % 6; ++i)
      if (camera_->next(frame, milliseconds(2)) == Next::kFrame) camera_->recycle(frame);
    camera_.reset();
    expectNoneAlive();
  }
}

}  // namespace
}  // namespace tractiond::capture::odd_camera_test
