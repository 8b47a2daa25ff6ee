// Command line of traction-touch.
#pragma once

#include "traction/subscriber.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>

namespace traction::contacts {

struct Arguments {
  SubscriberOptions source;       ///< of the fields; `source.instance` also names the sockets
  std::string hand;               ///< path of a hand file, in place of `source`; empty: none
  std::filesystem::path runtime;  ///< directory of the sockets; empty: to be found from the instance
};

/// Parses the command line. On failure returns an exit code: 0 after printing help or the version on standard output,
/// else after printing an error on standard error. Reads the file of the key, if one is needed, and throws as
/// sourceOf().
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace traction::contacts
