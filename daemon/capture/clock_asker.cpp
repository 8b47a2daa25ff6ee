#include "daemon/capture/clock_asker.h"

#include <algorithm>
#include <cstddef>

namespace tractiond::capture {

std::int64_t ClockAsker::pause_ns() const {
  constexpr std::int64_t kShortest_ns = 5'000'000, kLongest_ns = 62'500'000;
  // Of the span of the readings in use, of which there are 128: it grows to four fifths of the time since the first.
  constexpr std::int64_t kPart = 80;
  return std::clamp(fit_.span_ns() / kPart, kShortest_ns, kLongest_ns);
}

bool ClockAsker::ask() {
  ClockReading reading;
  reading.before_ns = counter_->rawNow();
  if (!counter_->latch()) return false;
  reading.after_ns = counter_->rawNow();
  std::array<std::uint8_t, 8> bytes{};
  if (!counter_->read(bytes)) return false;
  constexpr std::int64_t kUsual_ns = 100'000'000;  // a question that took longer may have latched twice
  if (reading.after_ns - reading.before_ns > kUsual_ns) return true;
  std::uint64_t ticks = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    ticks = ticks << 8 | bytes[counter_->bigEndian ? i : bytes.size() - 1 - i];
  // As Aravis counts a frame's stamp, which rounds.
  const std::uint64_t second_ns = 1'000'000'000, perSecond = counter_->perSecond;
  const auto rounded_ns = static_cast<std::int64_t>((second_ns + perSecond - 1) / perSecond);
  reading.device_ns =
      static_cast<std::int64_t>(ticks / perSecond * second_ns + ticks % perSecond * second_ns / perSecond);
  reading.before_ns -= rounded_ns;
  reading.after_ns += rounded_ns;
  fit_.add(reading);
  return true;
}

}  // namespace tractiond::capture
