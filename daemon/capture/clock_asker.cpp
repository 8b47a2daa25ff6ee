#include "daemon/capture/clock_asker.h"

#include <algorithm>
#include <cstddef>

namespace tractiond::capture {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// A question that took longer may have been sent twice, and have latched twice.
constexpr std::int64_t kUsual_ns = 100'000'000;
constexpr std::int64_t kShortest_ns = 5'000'000, kLongest_ns = 62'500'000, kUnanswered_ns = kSecond_ns;
/// Of the span of the readings in use, of which there are 128: it grows to four fifths of the time since the first.
constexpr std::int64_t kPart = 80;

}  // namespace

std::int64_t ClockAsker::pauseAfter(const ClockFit& fit) {
  return std::clamp(fit.span_ns() / kPart, kShortest_ns, kLongest_ns);
}

bool ClockAsker::ask() {
  using enum LatchedCounter::Answer;
  const LatchedCounter::Answer answer = question();
  refusals_ = answer == kRefused ? refusals_ + 1 : answer == kDone ? 0 : refusals_;
  pause_ns_ = answer == kDone ? pauseAfter(fit_) : kUnanswered_ns;
  return answer == kDone;
}

LatchedCounter::Answer ClockAsker::question() {
  using enum LatchedCounter::Answer;
  ClockReading reading;
  reading.before_ns = counter_->rawNow();
  if (const auto answer = counter_->latch(); answer != kDone) return answer;
  reading.after_ns = counter_->rawNow();
  std::array<std::uint8_t, 8> bytes{};
  if (const auto answer = counter_->read(bytes); answer != kDone) return answer;
  if (reading.after_ns - reading.before_ns > kUsual_ns) return kDone;
  std::uint64_t ticks = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    ticks = ticks << 8 | bytes[counter_->bigEndian ? i : bytes.size() - 1 - i];
  // As Aravis counts a frame's stamp, which rounds.
  const std::uint64_t second_ns = static_cast<std::uint64_t>(kSecond_ns), perSecond = counter_->perSecond;
  const auto rounded_ns = static_cast<std::int64_t>((second_ns + perSecond - 1) / perSecond);
  reading.device_ns =
      static_cast<std::int64_t>(ticks / perSecond * second_ns + ticks % perSecond * second_ns / perSecond);
  reading.before_ns -= rounded_ns;
  reading.after_ns += rounded_ns;
  fit_.add(reading);
  return kDone;
}

}  // namespace tractiond::capture
