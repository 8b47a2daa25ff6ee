// Parses the command line of a program.
#pragma once

#include "manual/describe.h"

#include <CLI/CLI.hpp>
#include <sysexits.h>
#include <tl/expected.hpp>

#include <iostream>

namespace manual {

/// Parses the command line, which has describable()'s flag as well. On failure returns an exit code: 0 after printing
/// help or the version on standard output, EX_USAGE after printing an error on standard error.
inline tl::expected<void, int> parse(CLI::App& app, int argc, char** argv) try {
  describable(app);
  app.parse(argc, argv);
  return {};
} catch (const CLI::ParseError& stop) {
  if (stop.get_exit_code() == 0) return tl::unexpected(app.exit(stop));
  std::cerr << app.get_name() << ": " << stop.what() << "; see " << app.get_name() << " --help\n";
  return tl::unexpected(EX_USAGE);
}

}  // namespace manual
