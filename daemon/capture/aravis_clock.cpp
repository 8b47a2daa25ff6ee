// Strategy. The registers of the standards (GigE Vision 1.2, 27.22; GenCP 1.2, 4.2) instead of the description's
// features: one question latches, and one reads, so that as little as possible lies between the two looks at the host's
// clock; and Aravis lets threads share registers, not features. The features only say that there is a latch.
#include "base/clock.h"
#include "daemon/capture/aravis.h"

#include <pthread.h>

namespace tractiond::capture {
namespace {

/// The registers of a device, which outlives it.
class Registers final : public LatchedCounter {
 public:
  Registers(ArvDevice* device, std::uint64_t latch, std::uint32_t command, std::uint64_t value)
      : device_(device)
      , latch_(latch)
      , command_(command)
      , value_(value) {}

  bool latch() override { return arv_device_write_register(device_, latch_, command_, nullptr) != FALSE; }
  bool read(std::array<std::uint8_t, 8>& bytes) override {
    return arv_device_read_memory(device_, value_, static_cast<std::uint32_t>(bytes.size()), bytes.data(), nullptr) !=
           FALSE;
  }
  std::int64_t rawNow() override { return tractiond::rawNow(); }

 private:
  ArvDevice* device_;
  std::uint64_t latch_;
  std::uint32_t command_;
  std::uint64_t value_;
};

}  // namespace

std::unique_ptr<AskedClock> AskedClock::open(ArvDevice* device) {
  constexpr std::uint64_t kFastest_Hz = 1'000'000'000;  // of cameras
  if (firstFeature(device, {"TimestampLatch", "GevTimestampControlLatch"}).empty()) return nullptr;
  std::unique_ptr<LatchedCounter> counter;
  if (ARV_IS_GV_DEVICE(device)) {
    counter = std::make_unique<Registers>(device, 0x0944, 2, 0x0948);
    counter->bigEndian = true;
    counter->perSecond = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), nullptr);
    // Without it, Aravis dates frames by the host's clock.
    if (counter->perSecond == 0 || counter->perSecond > kFastest_Hz) return nullptr;
  } else if (ARV_IS_UV_DEVICE(device)) {
    counter = std::make_unique<Registers>(device, 0x01f8, 1, 0x01f0);
  } else {
    return nullptr;
  }
  ClockAsker asker(std::move(counter));
  for (int i = 0; i < 3; ++i)
    if (!asker.ask()) return nullptr;
  if (asker.fit().readings() < 2) return nullptr;  // what is latched stands still
  std::unique_ptr<AskedClock> clock(new AskedClock);
  clock->fit_.put(asker.fit());
  clock->thread_ = std::jthread([asked = clock.get(), asker = std::move(asker)](const std::stop_token& stop) mutable {
    asked->run(stop, std::move(asker));
  });
  return clock;
}

void AskedClock::run(const std::stop_token& stop, ClockAsker asker) {
  pthread_setname_np(pthread_self(), "camera-clock");
  constexpr std::int64_t kUnanswered_ns = 1'000'000'000;
  for (std::int64_t pause_ns = asker.pause_ns();;) {
    pauseUntil(monotonicNow() + pause_ns, stop);
    if (stop.stop_requested()) return;
    const bool answered = asker.ask();
    if (answered) fit_.put(asker.fit());  // while the other side takes one, the next brings it
    pause_ns = answered ? asker.pause_ns() : kUnanswered_ns;
  }
}

}  // namespace tractiond::capture
