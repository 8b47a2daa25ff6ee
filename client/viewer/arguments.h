// Command line of traction-view.
#pragma once

#include "client/viewer/server.h"

#include <tl/expected.hpp>

#include <vector>

namespace traction::view {

struct Arguments {
  ServerOptions server;
  std::vector<SourceOptions> sources;  ///< one per sensor; never empty
};

/// Parses the command line and reads the keys that it names. On failure returns an exit code: 0 after printing help or
/// the version on standard output, EX_USAGE after printing an error on standard error, also for an address beyond the
/// loopback without --insecure.
/// \throws client::Failure, Error kBadKeys if a file of keys is wrong or missing
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace traction::view
