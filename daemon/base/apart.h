// Work that may wait for a disk.
#pragma once

#include "daemon/base/counter.h"

#include <chrono>
#include <future>
#include <utility>

namespace tractiond {

/// Done on a thread of its own and waited for. The loop's turns are counted meanwhile, or the watchdog would take a
/// slow disk for a stall; not for longer than any disk takes. \return what the work returns
template <typename Work>
auto apart(Counter& turns, Work work) {
  constexpr std::chrono::milliseconds kTurn(50);
  constexpr int kMost = 600;
  auto done = std::async(std::launch::async, std::move(work));
  for (int i = 0; done.wait_for(kTurn) != std::future_status::ready; ++i) {
    if (i < kMost) turns.add();
  }
  return done.get();
}

}  // namespace tractiond
