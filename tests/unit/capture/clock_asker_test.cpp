#include "daemon/capture/clock_asker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tractiond::capture::clock_asker_test {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000, kSecond_ns = 1'000'000'000;
constexpr std::int64_t kHost_ns = 70'000 * kSecond_ns, kDevice_ns = 3'000 * kSecond_ns;  // at true time 0

/// A camera 200 ppm fast, whose answers take about a millisecond.
class ClockAskerTest : public testing::Test {
 protected:
  /// The camera's counter.
  class Counter final : public LatchedCounter {
   public:
    explicit Counter(ClockAskerTest& test)
        : test_(test) {}
    bool latch() override {
      // No two answers take as long, or all times would be multiples of that.
      test_.now_ns_ += 7919 * ++test_.questions_ % 50'000 + kMillisecond_ns / 2;
      if (!test_.standsStill_)
        latched_ =
            static_cast<std::uint64_t>(std::floor(static_cast<long double>(test_.shown_ns()) * perSecond / kSecond_ns));
      test_.now_ns_ += kMillisecond_ns / 2;
      return true;
    }
    bool read(std::array<std::uint8_t, 8>& bytes) override {
      for (std::size_t i = 0; i < 8; ++i)
        bytes[i] = static_cast<std::uint8_t>(latched_ >> (bigEndian ? 56 - 8 * i : 8 * i));
      test_.now_ns_ += kMillisecond_ns;
      return test_.answers_;
    }
    std::int64_t rawNow() override { return kHost_ns + test_.now_ns_; }

   private:
    ClockAskerTest& test_;
    std::uint64_t latched_ = 0;
  };

  ClockAsker asker(std::uint64_t perSecond = kSecond_ns, bool bigEndian = true) {
    auto counter = std::make_unique<Counter>(*this);
    counter->perSecond = perSecond;
    counter->bigEndian = bigEndian;
    return ClockAsker(std::move(counter));
  }
  std::int64_t shown_ns() const {
    return kDevice_ns + set_ns_ + now_ns_ + std::llround(200e-6 * static_cast<double>(now_ns_));
  }

  /// As many questions, with the pauses between them.
  void ask(ClockAsker& asker, int questions) {
    for (int i = 0; i < questions; ++i) {
      EXPECT_EQ(asker.ask(), answers_);
      now_ns_ += asker.pause_ns();
    }
  }

  std::int64_t questions_ = 0, now_ns_ = 0;
  std::int64_t set_ns_ = 0;  ///< by so much somebody has set the camera's clock
  bool answers_ = true, standsStill_ = false;
};

TEST_F(ClockAskerTest, KnowsWhenTheCameraShowedWhatItDoesWhateverItCountsIn) {
  for (const std::uint64_t perSecond : {1'000'000'000U, 125'000'000U, 33'333'333U, 1'000'000U}) {
    for (const bool bigEndian : {true, false}) {
      now_ns_ = 0;
      ClockAsker one = asker(perSecond, bigEndian);
      ask(one, 100);
      const std::int64_t tick_ns = static_cast<std::int64_t>(kSecond_ns / perSecond);
      const auto span = one.fit().at(shown_ns(), tick_ns);
      ASSERT_TRUE(span) << perSecond;
      EXPECT_LE(span->earliest_ns, kHost_ns + now_ns_) << perSecond;
      EXPECT_GE(span->latest_ns, kHost_ns + now_ns_) << perSecond;
      // What two looks are apart, and a little for the drift in the eighth of a second since.
      EXPECT_LE(span->latest_ns - span->earliest_ns, 11 * kMillisecond_ns / 10 + 6 * tick_ns) << perSecond;
    }
  }
}

TEST_F(ClockAskerTest, AsksLessOftenTheLongerItKnowsTheClockAndAgainWhenThatIsSet) {
  ClockAsker one = asker();
  EXPECT_EQ(one.pause_ns(), 5 * kMillisecond_ns);
  ask(one, 100);
  EXPECT_GT(one.pause_ns(), 5 * kMillisecond_ns);
  ask(one, 300);
  EXPECT_EQ(one.pause_ns(), kSecond_ns / 16);
  set_ns_ = -kDevice_ns;
  ask(one, 1);
  EXPECT_EQ(one.pause_ns(), 5 * kMillisecond_ns);
  EXPECT_EQ(one.fit().readings(), 1U);
}

TEST_F(ClockAskerTest, LearnsNothingFromACameraThatDoesNotAnswerOrWhoseClockStandsStill) {
  ClockAsker one = asker();
  answers_ = false;
  ask(one, 10);
  EXPECT_EQ(one.fit().readings(), 0U);
  answers_ = standsStill_ = true;
  ask(one, 10);
  EXPECT_LT(one.fit().readings(), 2U);
  EXPECT_FALSE(one.fit().at(0));
}

}  // namespace
}  // namespace tractiond::capture::clock_asker_test
