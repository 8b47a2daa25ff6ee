// Command line of traction-lens.
#pragma once

#include "lens/commands.h"

#include <tl/expected.hpp>

#include <functional>

namespace lens {

/// A command with its options, of which it holds copies.
using Command = std::function<Done()>;

/// Parses the command line; does not read files. On failure returns an exit code: 0 after printing help or the version
/// to standard output, EX_USAGE after printing an error to standard error.
tl::expected<Command, int> parseArguments(int argc, char** argv);

}  // namespace lens
