// As hot_path_test, from a camera: popping, admitting and giving back, with one packet in a hundred lost.
#include "daemon/app/pipeline.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/camera.h"
#include "tests/unit/app/interposed.h"
#include "tests/unit/capture/fake_camera.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

namespace tractiond::hot_capture_test {
namespace {

TEST(HotCapture, AllocatesAndLocksNothing) {
  test::FakeCamera fake({.rate_Hz = 200});
  Ledger ledger;
  capture::CameraOptions options;
  options.id = "127.0.0.1";
  auto camera = capture::Camera::open(capture::fromAravis(options), {}, ledger);
  ASSERT_TRUE(camera) << camera.error().message();

  // Counts from the first frame after the warm-up to the last before the stop.
  class Marked : public capture::FrameSource {
   public:
    explicit Marked(capture::FrameSource& inner)
        : inner_(inner) {}
    capture::Next next(Frame& frame, std::chrono::milliseconds timeout) override {
      if (turns == 0) interposed::markThisThread();
      if (turns == 50) interposed::count(true);
      if (turns == 250) {
        void* volatile proof = std::malloc(1);
        std::free(proof);
        interposed::count(false);
      }
      ++turns;
      return inner_.next(frame, timeout);
    }
    void recycle(Frame& frame) override { inner_.recycle(frame); }
    std::atomic<int> turns{0};

   private:
    capture::FrameSource& inner_;
  } source(**camera);

  struct Idle final : Stages {
    bool track(const Frame& /*frame*/, MarkerField& /*markers*/) override { return true; }
    void solve(const MarkerField& /*markers*/, TractionField& /*field*/) override {}
    void publish(const TractionField& /*field*/) override {}
    void serveSubscribers(int /*fd*/, std::chrono::milliseconds /*timeout*/) override { std::this_thread::yield(); }
  } stages;
  Turns turns;
  Pipeline pipeline(source, stages, {.markers = 1, .nodes = 1}, ledger, turns);
  pipeline.start();
  while (source.turns < 260) std::this_thread::yield();
  pipeline.stop();

  EXPECT_TRUE(balanced(ledger));
  EXPECT_GT(ledger.published.get(), 0U);
  EXPECT_EQ(interposed::ours().allocations, 1U) << "the proof that this thread is counted, and nothing else";
  EXPECT_EQ(interposed::ours().frees, 1U);
  EXPECT_EQ(interposed::ours().locks, 0U);
}

}  // namespace
}  // namespace tractiond::hot_capture_test
