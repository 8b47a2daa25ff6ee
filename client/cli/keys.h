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

/// Returns $XDG_CONFIG_HOME/traction/key, or the same below $HOME/.config, whether or not the file exists. Variables
/// that are not absolute paths count as not set.
std::filesystem::path usualKeyFile();

// All functions below throw KeyError: EX_USAGE for an invalid name or key; EX_NOINPUT if a file does not exist or
// cannot be read; EX_CONFIG if its content is not valid; EX_CANTCREAT if it cannot be written; EX_NOPERM without the
// permission, or if a secret file can be read by others. Those that print do so on standard output, and throw
// OutputError if it cannot be written. `directory` is the gateway's directory of keys. A name is 1 to 24 of A-Z, a-z,
// 0-9, _ and -; a key is 40 characters of Z85.

/// Writes a new random key pair into a new file with mode 0600, and creates its directories. Prints the command that
/// allows its public key under `name` on the gateway's machine. \throws KeyError EX_CANTCREAT also if the file exists
void newKey(const std::string& name, const std::filesystem::path& file);
/// Allows a key under a name: to read, or with `control` also to send requests. Replaces an earlier key of this name;
/// the gateway then ends all connections, and the clients that are still allowed connect again. Creates the gateway's
/// own key pair if there is none. Prints the command with which a client connects. \throws KeyError, and allows
/// nothing: also EX_DATAERR if the key is allowed under another name, EX_NOPERM if every user can write into the
/// directory, EX_CONFIG if it would have more than 1,000 keys; and if the gateway's own key pair cannot be read or is
/// faulty
void allowKey(const std::filesystem::path& directory, const std::string& name, const std::string& key, bool control);
/// Deletes the file of the key with this name; the gateway then closes its connections. Prints nothing.
void revokeKey(const std::filesystem::path& directory, const std::string& name);
/// Prints the gateway's public key, and the allowed keys with their permissions, as text or as one line of JSON.
/// \throws KeyError only after printing: the first faulty file, or else the reason why the gateway's key cannot be read
void listKeys(const std::filesystem::path& directory, bool json);

/// Returns the client's keys for a connection to a gateway; empty keys if neither argument is given and usualKeyFile()
/// does not exist. Prints nothing. \param serverKey public key of the gateway; empty: that of the file
/// \param file empty: usualKeyFile()
/// \throws Error kBadKeys if the file cannot be read or is not valid; KeyError: EX_NOINPUT if usualKeyFile() is needed
/// and does not exist, EX_USAGE if neither argument nor file has the gateway's key
Keys keysFor(const std::string& serverKey, const std::filesystem::path& file);

}  // namespace traction::cli
