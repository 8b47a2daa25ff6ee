// Command line of traction-input.
#pragma once

#include "traction/subscriber.h"

#include <tl/expected.hpp>

#include <string>

namespace traction::input {

struct Arguments {
  SubscriberOptions source;  ///< of the fields
  std::string profile;       ///< name of a shipped one, or path of a file; or else
  std::string taught;        ///< symbol whose strokes are printed
  bool areDigits = false;    ///< they are of the mode "digits"
  bool checks = false;       ///< true: only checks the profile
};

/// Parses the command line. On failure returns an exit code: 0 after printing help or the version on standard output,
/// else after printing an error on standard error. Reads the file of the key, if one is needed, and throws as
/// contacts::sourceOf().
tl::expected<Arguments, int> parseArguments(int argc, char** argv);

}  // namespace traction::input
