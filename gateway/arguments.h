// Command line of traction-gateway.
#pragma once

#include <tl/expected.hpp>

#include <filesystem>
#include <string>

namespace tractiond::gateway {

struct Arguments {
  std::string instance = "default";
  std::filesystem::path config, runtime;
  bool checkConfig = false, printConfig = false;
};

/// Parses the command line. On failure returns an exit code: 0 after printing help or the version, EX_USAGE after
/// printing an error.
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace tractiond::gateway
