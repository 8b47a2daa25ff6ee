// Command line of traction-lens.
#pragma once

#include "lens/commands.h"

#include <tl/expected.hpp>

#include <functional>

namespace lens {

/// A command with its options, of which it holds copies.
using Command = std::function<Done(Report&)>;

struct Request {
  Command command;
  bool json = false;  ///< the report is for a program
};

/// Parses the command line; does not read files. On failure returns an exit code: 0 after printing help or the version
/// to standard output, EX_USAGE after printing an error to standard error.
tl::expected<Request, int> parseArguments(int argc, char** argv);

}  // namespace lens
