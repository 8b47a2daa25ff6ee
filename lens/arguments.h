// Command line of traction-lens.
#pragma once

#include "lens/commands.h"

#include <tl/expected.hpp>

#include <functional>

namespace lens {

/// A command with its options.
using Command = std::function<Done()>;

/// Parses the command line. On failure returns an exit code: 0 after printing help or the version, EX_USAGE after
/// printing an error.
tl::expected<Command, int> parseArguments(int argc, char** argv);

}  // namespace lens
