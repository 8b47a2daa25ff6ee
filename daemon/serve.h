// Serves a camera, or computes a recording again. Both return an exit code.
#pragma once

#include "daemon/arguments.h"
#include "daemon/config.h"

#include <tl/expected.hpp>

namespace tractiond {

/// Prints an error that prevents the start, as the first line of a log, and returns its exit code.
int failed(const Error& error);

/// Reads the configuration, and adds the options of the command line. Errors: those of loadConfig().
tl::expected<Config, Error> configured(const Arguments& arguments, const Places& places);

/// Serves until SIGTERM or SIGINT. Must be called by the main thread, before any other thread starts.
int serve(const Arguments& arguments, const Config& config, const Places& places);

/// Computes the recording that the arguments name again.
int replayRecording(const Arguments& arguments, const Config& config, const Places& places);

}  // namespace tractiond
