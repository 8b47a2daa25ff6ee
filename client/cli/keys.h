// tractionctl keys: manages the keys for gateways.
#pragma once

#include "traction/keys.h"

#include <filesystem>
#include <stdexcept>
#include <string>

namespace traction::cli {

/// A failed key operation, with an exit code of sysexits.h.
class KeyError : public std::runtime_error {
 public:
  KeyError(int exitCode, const std::string& what)
      : std::runtime_error(what)
      , exitCode_(exitCode) {}
  int exitCode() const { return exitCode_; }

 private:
  int exitCode_;
};

/// Returns $XDG_CONFIG_HOME/traction/key, or the same below ~/.config.
std::filesystem::path usualKeyFile();

// All functions below \throw KeyError.
/// Writes a new key pair into a new file, and prints how to allow its public key on the gateway's machine.
void newKey(const std::string& name, const std::filesystem::path& file);
/// Allows a key to read, or also to control. Creates the gateway's own key pair if there is none. Prints the command
/// that a client connects with.
void allowKey(const std::filesystem::path& directory, const std::string& name, const std::string& key, bool control);
/// Revokes the key of a name.
void revokeKey(const std::filesystem::path& directory, const std::string& name);
/// Prints the gateway's public key, and the allowed keys with their permissions.
void listKeys(const std::filesystem::path& directory, bool json);

/// Returns the keys for a gateway; empty keys if neither argument is given and there is no usual file. \param serverKey
/// empty: that of the file
/// \param file empty: usualKeyFile()
Keys keysFor(const std::string& serverKey, const std::filesystem::path& file);

}  // namespace traction::cli
