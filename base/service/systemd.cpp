#include "base/service/systemd.h"

#include <systemd/sd-daemon.h>

#include <cstdint>

namespace tractiond::systemd {

void notify(const std::string& text) {
  sd_notify(0, text.c_str());
}

std::chrono::microseconds watchdog() {
  std::uint64_t deadline_us = 0;
  return std::chrono::microseconds(sd_watchdog_enabled(0, &deadline_us) > 0 ? deadline_us : 0);
}

}  // namespace tractiond::systemd
