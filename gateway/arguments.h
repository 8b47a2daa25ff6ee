// Command line of traction-gateway.
#pragma once

#include <tl/expected.hpp>

#include <filesystem>
#include <string>

namespace tractiond::gateway {

struct Arguments {
  std::string instance = "default";  ///< name of a tractiond on this machine
  /// Configuration file, empty: /etc/tractiond/gateway/INSTANCE.toml, if it exists; and directory of the instance's
  /// sockets, empty: to be found from `instance`.
  std::filesystem::path config, runtime;
  /// True: the program checks the configuration, or prints it with every key, and exits.
  bool checkConfig = false, printConfig = false;
};

/// Parses the command line. On failure returns an exit code: 0 after printing help or the version on standard output,
/// EX_USAGE after printing an error on standard error. Opens no file.
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace tractiond::gateway
