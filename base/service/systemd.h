// What a service and systemd tell each other: by the operating system, or in the simulated world (tests/simulation),
// whichever is linked.
#pragma once

#include <chrono>
#include <string>

namespace tractiond::systemd {

/// Tells systemd, as sd_notify(3) does, but never waits: while systemd reads nothing, notices are dropped. Returns
/// false if it was dropped; true if it was sent, and if the program does not run under systemd (no NOTIFY_SOCKET).
/// \param text "READY=1", or several lines
bool notify(const std::string& text);

/// Returns the time after which systemd ends a service that has not fed the watchdog (WatchdogSec=); 0: there is none.
std::chrono::microseconds watchdog();

}  // namespace tractiond::systemd
