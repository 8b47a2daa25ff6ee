// Strategy. The registers of the standards (GigE Vision 1.2, 27.22; GenCP 1.2, 4.2) instead of the description's
// features: one question latches, and one reads, so that as little as possible lies between the two looks at the host's
// clock; and Aravis lets threads share registers, not features. The features only say that there is a latch.
#include "daemon/base/clock.h"
#include "daemon/capture/aravis.h"

#include <pthread.h>

#include <array>

namespace tractiond::capture {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// So quick an answer came to the first question: nothing was sent again that latches once more.
constexpr std::int64_t kUsual_ns = 100'000'000;
/// Until the drift is known; then; and where the camera did not answer.
constexpr std::int64_t kAtFirst_ns = 20'000'000, kUsually_ns = 125'000'000, kUnanswered_ns = kSecond_ns;
constexpr std::size_t kFirst = 60;
constexpr int kRefusals = 3;

}  // namespace

std::unique_ptr<AskedClock> AskedClock::open(ArvDevice* device) {
  if (firstFeature(device, {"TimestampLatch", "GevTimestampControlLatch"}).empty()) return nullptr;
  Registers registers;
  if (ARV_IS_GV_DEVICE(device)) {
    registers = {.latch = 0x0944, .command = 2, .value = 0x0948, .bigEndian = true};
    registers.perSecond = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), nullptr);
    // Without it, Aravis dates frames by the host's clock; and no camera counts faster.
    if (registers.perSecond == 0 || registers.perSecond > static_cast<std::uint64_t>(kSecond_ns)) return nullptr;
  } else if (ARV_IS_UV_DEVICE(device)) {
    registers = {.latch = 0x01f8, .command = 1, .value = 0x01f0};
  } else {
    return nullptr;
  }
  std::unique_ptr<AskedClock> clock(new AskedClock(device, registers));
  ClockFit fit;
  for (std::size_t i = 0; i < 3; ++i)
    if (!clock->ask(fit)) return nullptr;
  if (fit.readings() < 2) return nullptr;  // what is latched stands still
  clock->fit_.put(fit);
  clock->thread_ = std::jthread([asked = clock.get(), fit](const std::stop_token& stop) { asked->run(stop, fit); });
  return clock;
}

/// False: the camera did not say.
bool AskedClock::ask(ClockFit& fit) {
  std::array<std::uint8_t, 8> bytes{};
  Failure failure;
  ClockReading reading;
  reading.before_ns = rawNow();
  arv_device_write_register(device_, registers_.latch, registers_.command, failure.into());
  reading.after_ns = rawNow();
  refused_ = failure && !failure.noAnswer();
  if (failure) return false;
  arv_device_read_memory(device_, registers_.value, bytes.size(), bytes.data(), failure.into());
  refused_ = failure && !failure.noAnswer();
  if (failure) return false;
  if (reading.after_ns - reading.before_ns > kUsual_ns) return true;
  std::uint64_t ticks = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    ticks = ticks << 8 | bytes[registers_.bigEndian ? i : bytes.size() - 1 - i];
  // As Aravis counts a frame's stamp, which rounds.
  const std::uint64_t second_ns = static_cast<std::uint64_t>(kSecond_ns), perSecond = registers_.perSecond;
  const auto rounded_ns = static_cast<std::int64_t>((second_ns + perSecond - 1) / perSecond);
  reading.device_ns =
      static_cast<std::int64_t>(ticks / perSecond * second_ns + ticks % perSecond * second_ns / perSecond);
  reading.before_ns -= rounded_ns;
  reading.after_ns += rounded_ns;
  fit.add(reading);
  return true;
}

void AskedClock::run(const std::stop_token& stop, ClockFit fit) {
  pthread_setname_np(pthread_self(), "camera-clock");
  int refusals = 0;
  std::int64_t pause_ns = kAtFirst_ns;
  while (refusals < kRefusals) {
    pauseUntil(monotonicNow() + pause_ns, stop);
    if (stop.stop_requested()) return;
    if (ask(fit)) {
      refusals = 0;
      fit_.put(fit);  // while the other side takes one, the next brings it
      pause_ns = fit.readings() < kFirst ? kAtFirst_ns : kUsually_ns;
    } else {
      refusals += refused_ ? 1 : 0;
      pause_ns = kUnanswered_ns;
    }
  }
}

}  // namespace tractiond::capture
