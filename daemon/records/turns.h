// How far the stages are: what the watchdog and the status look at.
#pragma once

#include "daemon/base/counter.h"

namespace tractiond {

/// Turns of each stage's loop since the start, counted by its thread, also when there is nothing to do. A stage that
/// stands still hangs.
struct Turns {
  Counter capture, track, solve, publish, control;
};

}  // namespace tractiond
