// Progress of the stages, for the liveness check and the status.
#pragma once

#include "base/counter.h"

#include <vector>

namespace tractiond {

/// Turns of each stage's loop since the start, counted by its thread, also when there is nothing to do. A stage whose
/// counter stands still hangs.
struct Turns {
  Counter capture, track, solve, publish, control;
};

/// Returns the counters of all five stages, in the order of Turns. `turns` must outlive the result.
inline std::vector<const Counter*> loopsOf(const Turns& turns) {
  return {&turns.capture, &turns.track, &turns.solve, &turns.publish, &turns.control};
}

}  // namespace tractiond
