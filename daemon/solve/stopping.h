// Lets a long computation be given up between two of its steps.
#pragma once

#include "base/error.h"

#include <tl/expected.hpp>

#include <functional>

namespace tractiond::solve {

/// Called between the steps of a computation, on its thread. If it returns true, no further step is taken, and the
/// computation fails with givenUp(). Empty: the computation runs to its end.
using Stopping = std::function<bool()>;

/// Calls `stopping` and returns its result: true, to give up. Returns false if it is empty.
inline bool isStopped(const Stopping& stopping) {
  return stopping && stopping();
}

/// Returns the error of a computation that was given up, as the daemon stops; its exit code is EX_SOFTWARE.
tl::unexpected<Error> givenUp();

}  // namespace tractiond::solve
