// Moves the clocks of a run from moment to moment of its story.
#pragma once

#include "tests/simulation/story.h"

#include <algorithm>
#include <functional>

namespace tractiond::simulation {

/// Runs a story to its end. Returns false if `goesOn`, asked once for each simulated second, ended it before.
/// \param nextMoment returns when turn() has something to do next \param happen is called with each happening in its
/// time \param turn is called at each moment
template <typename NextMoment, typename Happen, typename Turn>
bool follow(const Story& story, const std::function<bool()>& goesOn, NextMoment nextMoment, Happen happen, Turn turn) {
  const std::int64_t begin_ns = now(), end_ns = begin_ns + story.lasts_ms * kMs;
  const auto at_ns = [&](std::size_t i) {
    return i < story.happenings.size() ? begin_ns + story.happenings[i].at_ms * kMs : kNever;
  };
  std::int64_t asked_ns = begin_ns;
  for (std::size_t next = 0; now() < end_ns;) {
    clocks().monotonic_ns = std::max(now(), std::min({nextMoment(), at_ns(next), end_ns}));
    while (at_ns(next) <= now()) happen(story.happenings[next++]);
    turn();
    if (!goesOn || now() - asked_ns < kSecond) continue;
    asked_ns = now();
    if (!goesOn()) return false;
  }
  return true;
}

}  // namespace tractiond::simulation
