// The gateway as a service.
#pragma once

#include "gateway/config.h"

#include <filesystem>

namespace tractiond::gateway {

/// Prints an error that prevents the start to standard error, in the form of a log line, and returns its exit code.
int failed(const Error& error);

/// Serves until SIGTERM or SIGINT, or until the relay fails; logs the error then. Returns an exit code of sysexits.h.
/// Must be called by the main thread before this program starts its first thread. \param runtime directory of the
/// instance's sockets
int serve(const Config& config, const std::filesystem::path& runtime);

}  // namespace tractiond::gateway
