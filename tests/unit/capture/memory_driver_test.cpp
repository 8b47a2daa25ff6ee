#include "daemon/capture/camera.h"
#include "daemon/capture/memory_driver.h"

#include <gtest/gtest.h>

namespace tractiond::capture::memory_driver_test {
namespace {

using std::chrono::milliseconds;

class MemoryDriverTest : public testing::Test {
 protected:
  MemoryDriverTest() { now_ns_ = 1'000'000'000; }

  MemoryOptions paced(std::uint64_t loops, std::int64_t period_ns) {
    MemoryOptions options;
    options.loops = loops;
    options.period_ns = period_ns;
    options.now = [] { return now_ns_; };
    options.sleepUntil = [](std::int64_t until_ns) { now_ns_ = until_ns; };
    return options;
  }

  std::unique_ptr<Camera> open(const MemoryOptions& options) {
    return *Camera::open(fromMemory(pictures_, options), {.silenceTimeout_ms = 0}, ledger_);
  }

  Ledger ledger_;
  Pictures pictures_{4, 2, PixelFormat::kBayerRG8, {std::vector<std::uint8_t>(8, 1), std::vector<std::uint8_t>(8, 2)}};
  static inline std::int64_t now_ns_ = 0;
};

TEST_F(MemoryDriverTest, HandsOutThePicturesThemselvesInTurnAndEnds) {
  const auto source = open(paced(3, 0));
  Frame frame;
  for (std::uint64_t n = 1; n <= 6; ++n) {
    ASSERT_EQ(source->next(frame, milliseconds(100)), Next::kFrame);
    EXPECT_EQ(frame.data, pictures_.data[(n - 1) % 2].data());
    EXPECT_EQ(frame.size, 8U);
    EXPECT_EQ(frame.stride, 4);
    EXPECT_EQ(frame.format, PixelFormat::kBayerRG8);
    EXPECT_EQ(frame.info.frameNumber, n);
    EXPECT_EQ(frame.info.cameraFrameId, n);
    EXPECT_FALSE(frame.info.discontinuity);
    EXPECT_EQ(frame.info.times.received_ns, now_ns_);
    source->recycle(frame);
  }
  EXPECT_EQ(source->next(frame, milliseconds(0)), Next::kEnd);
  EXPECT_EQ(source->next(frame, milliseconds(0)), Next::kEnd);
  EXPECT_EQ(source->error().exitCode, EX_OK) << "that was all";
  EXPECT_EQ(ledger_.received.get(), 6U);
}

TEST_F(MemoryDriverTest, KeepsItsPace) {
  const auto source = open(paced(0, 20'000'000));
  Frame frame;
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(source->next(frame, milliseconds(100)), Next::kFrame);
    EXPECT_EQ(frame.info.times.received_ns, 1'000'000'000 + i * std::int64_t{20'000'000});
    now_ns_ += 3'000'000;  // the consumer's time is not added
  }
}

TEST_F(MemoryDriverTest, TimesOutBeforeTheNextIsDue) {
  const auto source = open(paced(1, 50'000'000));
  Frame frame;
  ASSERT_EQ(source->next(frame, milliseconds(10)), Next::kFrame);
  for (int i = 1; i <= 4; ++i) {
    EXPECT_EQ(source->next(frame, milliseconds(10)), Next::kTimeout);
    EXPECT_EQ(now_ns_, 1'000'000'000 + i * std::int64_t{10'000'000});
  }
  EXPECT_EQ(source->next(frame, milliseconds(10)), Next::kFrame);
}

}  // namespace
}  // namespace tractiond::capture::memory_driver_test
