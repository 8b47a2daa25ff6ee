// tractionctl keys: who may come in through a gateway.
#pragma once

#include "traction/keys.h"

#include <filesystem>
#include <stdexcept>
#include <string>

namespace traction::cli {

/// It cannot be done; with an exit code of sysexits.h.
class KeyError : public std::runtime_error {
 public:
  KeyError(int exitCode, const std::string& what)
      : std::runtime_error(what)
      , exitCode_(exitCode) {}
  int exitCode() const { return exitCode_; }

 private:
  int exitCode_;
};

/// $XDG_CONFIG_HOME/traction/key, or below ~/.config.
std::filesystem::path usualKeyFile();

// All of them \throw KeyError.
/// A pair into a new file; prints how its public half is allowed on the box.
void newKey(const std::string& name, const std::filesystem::path& file);
/// On the box: somebody may read, or control. The box's own pair is made where it has none.
void allowKey(const std::filesystem::path& directory, const std::string& name, const std::string& key, bool control);
void revokeKey(const std::filesystem::path& directory, const std::string& name);
/// The box's public key, and who may do what.
void listKeys(const std::filesystem::path& directory, bool json);

/// For a gateway. \param serverKey empty: the file's own \param file empty: the usual one, if it is there
Keys keysFor(const std::string& serverKey, const std::filesystem::path& file);

}  // namespace traction::cli
