// The keys of a client for gateways.
#pragma once

#include "traction/keys.h"

#include <filesystem>
#include <string>

namespace traction::client {

/// Returns $XDG_CONFIG_HOME/traction/key, or the same below $HOME/.config, whether or not the file exists. Variables
/// that are not absolute paths count as not set.
std::filesystem::path usualKeyFile();

/// Returns the client's keys for a connection to a gateway; empty keys if neither argument is given and usualKeyFile()
/// does not exist. Prints nothing.
/// \param serverKey public key of the gateway; empty: that of the file
/// \param file empty: usualKeyFile()
/// \throws Error kBadKeys if the file cannot be read or is not valid; Failure: EX_NOINPUT if usualKeyFile() is needed
/// and does not exist, EX_USAGE if neither argument nor file has the gateway's key
Keys keysFor(const std::string& serverKey, const std::filesystem::path& file);

}  // namespace traction::client
