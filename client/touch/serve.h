// Runs traction-touch until it is stopped.
#pragma once

#include "base/error.h"
#include "client/touch/arguments.h"

namespace traction::contacts {

/// Prints an error on standard error, and returns its exit code.
int failed(const tractiond::Error& error);

/// Follows contacts until SIGTERM or SIGINT, and publishes their ends then; or joins fields to grasps. Returns the exit
/// code.
int serve(const Arguments& arguments);

}  // namespace traction::contacts
