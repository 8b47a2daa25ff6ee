// The command line.
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

/// Or an exit code: 0 when help or the version was asked for and printed, EX_USAGE for an error that was printed.
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace tractiond::gateway
