// A link that loses one packet in a hundred, and a camera that pauses within its frames: how many come whole, and how
// much later.
#include "base/clock.h"
#include "tests/support/seed.h"
#include "tests/unit/capture/quirks.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <vector>

namespace tractiond::capture::resend_test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

struct Outcome {
  std::size_t whole = 0;
  std::vector<double> late_ms;  ///< from the last packet's first sending to next()
  double quantile(double share) const {
    return late_ms.empty() ? NAN : late_ms[static_cast<std::size_t>(share * static_cast<double>(late_ms.size() - 1))];
  }
};

class Resend : public Quirks {
 protected:
  static constexpr int kFrames = 300, kColumns = 320, kRows = 240;

  Resend() {
    width_ = kColumns;
    height_ = kRows;
    sender_.write(0x100, kColumns);
    sender_.write(0x104, kRows);
    sender_.write(0x934, 1U << 2U);  // it can send packets again
    sender_.resends = true;
    sender_.saysUnavailable = random_() % 2 == 0;
    sender_.pace = [this](std::size_t number, std::size_t count) {
      if (number == 0) pauseBefore_ = random() % 5 == 0 ? 1 + random() % (count - 1) : 0;
      if (number != 0 && number == pauseBefore_)
        std::this_thread::sleep_for(microseconds(random() % 6000));
      else if (number % 16 == 0)
        std::this_thread::sleep_for(microseconds(500));
    };
  }
  std::uint64_t random() { return paceRandom_(); }

  Outcome stream(double loss) {
    std::vector<std::atomic<std::int64_t>> sent_ns(65'536);  // by the frame's id
    sender_.loss = loss;
    std::atomic<bool> over{false};
    std::thread camera([&] {
      std::int64_t due_ns = monotonicNow();
      for (int i = 0; i < kFrames; ++i) {
        test::GvTransmitter::Picture one = picture(nextId_, nextId_);
        one.device_ticks = static_cast<std::uint64_t>(monotonicNow());
        sender_.send(one);
        sent_ns[nextId_++] = monotonicNow();
        due_ns += 16'666'667;
        std::this_thread::sleep_for(std::chrono::nanoseconds(due_ns - monotonicNow()));
      }
      over = true;
    });
    Outcome outcome;
    for (;;) {
      Frame frame;
      const bool last = over;
      const Next next = this->next(frame, milliseconds(200));
      if (next == Next::kTimeout && last) break;
      if (next != Next::kFrame) continue;
      const std::int64_t then_ns = sent_ns[frame.info.cameraFrameId], now_ns = monotonicNow();
      ++outcome.whole;
      outcome.late_ms.push_back(then_ns == 0 ? 0.0 : static_cast<double>(now_ns - then_ns) * 1e-6);
      camera_->recycle(frame);
    }
    camera.join();
    std::sort(outcome.late_ms.begin(), outcome.late_ms.end());
    return outcome;
  }

 private:
  std::size_t pauseBefore_ = 0;
  std::mt19937_64 paceRandom_{test::seed() + 3};
};

TEST_F(Resend, OnePacketInAHundredIsLostAndHardlyAFrame) {
  ASSERT_NO_FATAL_FAILURE(openStreaming());
  const std::uint64_t doubtedBefore = ledger_.doubted.get();
  const Outcome without = stream(0.0), with = stream(0.01);
  const std::uint64_t doubted = ledger_.doubted.get() - doubtedBefore;
  std::printf("  a camera that %s: without loss %zu of %d frames whole, late by p50 %.1f p99 %.1f ms; with 1 %% %zu, "
              "p50 %.1f p99 %.1f p99.9 %.1f ms, %llu doubted\n",
              sender_.saysUnavailable ? "says what it does not have" : "is silent of what it does not have",
              without.whole, kFrames, without.quantile(0.5), without.quantile(0.99), with.whole, with.quantile(0.5),
              with.quantile(0.99), with.quantile(0.999), static_cast<unsigned long long>(doubted));
  EXPECT_EQ(without.whole, std::size_t{kFrames});
  EXPECT_GE(static_cast<double>(with.whole), 0.995 * kFrames);
  EXPECT_LT(doubted, kFrames / 20) << "of a packet that was only late both may come";
}

}  // namespace
}  // namespace tractiond::capture::resend_test
