// What a service and systemd tell each other: by the operating system, or in the simulated world (tests/simulation),
// whichever is linked.
#pragma once

#include <chrono>
#include <string>

namespace tractiond::systemd {

/// Tells systemd, if the program runs under it: sd_notify(3).
/// \param text "READY=1", or several lines
void notify(const std::string& text);

/// Returns the time after which systemd ends a service that has not fed the watchdog (WatchdogSec=); 0: there is none.
std::chrono::microseconds watchdog();

}  // namespace tractiond::systemd
