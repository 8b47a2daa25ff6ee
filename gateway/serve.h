// The gateway as a service.
#pragma once

#include "gateway/config.h"

#include <filesystem>

namespace tractiond::gateway {

/// Prints an error that prevents the start, as the first line of a log, and returns its exit code.
int failed(const Error& error);

/// Serves until SIGTERM or SIGINT, and returns an exit code. \param runtime directory of the instance's sockets. To be
/// called by the main thread, before any other thread starts.
int serve(const Config& config, const std::filesystem::path& runtime);

}  // namespace tractiond::gateway
