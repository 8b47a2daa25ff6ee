// Command line of traction-view.
#pragma once

#include "client/viewer/server.h"

#include <tl/expected.hpp>

#include <vector>

namespace traction::view {

struct Arguments {
  ServerOptions server;
  std::vector<SourceOptions> sources;
};

/// Parses the command line and reads the keys that it names. On failure returns an exit code: 0 after printing help or
/// the version, EX_USAGE after printing an error. \throws cli::KeyError
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace traction::view
