// How threads share the processors where these are short and real time is not granted.
#pragma once

namespace tractiond {

/// What answers requests, ZeroMQ's threads for it included, runs with this much more niceness (nice(2)) than what a
/// frame passes: frames come first. Small enough that a turn of requests still ends within the watchdog's time.
inline constexpr int kControlNiceness = 5;

}  // namespace tractiond
