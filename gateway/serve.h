// The gateway as a service.
#pragma once

#include "gateway/config.h"

#include <filesystem>

namespace tractiond::gateway {

/// Prints an error that prevents the start to standard error, in the form of a log line, and returns its exit code.
/// Waits for the reader of standard error.
int failed(const Error& error);

/// Serves until SIGTERM or SIGINT (on a terminal also SIGHUP; elsewhere that has no effect but a log line), or until
/// the relay fails. Returns EX_OK if it was stopped. Otherwise logs the error and returns its exit code: EX_OSERR if
/// too few file descriptors are allowed, or those of Relay::open(). The relay runs on a thread of its own. Must be
/// called by the main thread before this program starts its first thread.
/// \param runtime directory of the instance's sockets
/// \param file of the configuration, where there is or may be one; for errors
int serve(const Config& config, const std::filesystem::path& runtime, const std::filesystem::path& file);

}  // namespace tractiond::gateway
