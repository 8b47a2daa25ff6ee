// How long tests wait for what must happen. Twin: deadline.py.
#pragma once

#include <chrono>

namespace tractiond::test {

/// Time after which a test fails because something hangs; longer than anything takes on a busy machine.
inline constexpr std::chrono::seconds kHung{120};
inline constexpr int kHung_ms = 120'000;

/// Calls `step`, which waits for a moment by itself, until it returns true. Returns false if it has not after kHung.
template <typename Step>
bool eventually(Step step) {
  const auto until = std::chrono::steady_clock::now() + kHung;
  while (!step()) {
    if (std::chrono::steady_clock::now() > until) return false;
  }
  return true;
}

}  // namespace tractiond::test
