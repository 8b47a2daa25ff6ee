// Keys as files: who may come in, and the secret ones of a box and of a person. Shared by the gateway, tractionctl and
// the client library. Keys are CURVE's, 40 letters of Z85.
#pragma once

#include "daemon/base/error.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::gateway {

inline constexpr const char* kKeyDirectory = "/etc/tractiond/keys";

enum class Permission {
  kRead,     ///< stream and latest
  kControl,  ///< and requests: zero, calibration, the camera
};

std::string_view wordOf(Permission permission);

/// Of somebody who may come in; the file NAME.key.
struct AllowedKey {
  std::string name;  ///< traction::isValidName
  std::string key;
  Permission permission = Permission::kRead;

  bool operator==(const AllowedKey&) const = default;
};

struct KeyPair {
  std::string publicKey, secretKey;
  std::string serverKey;  ///< of the box that it is for; empty: told otherwise
};

bool isKey(std::string_view text);

/// As text, of its 32 bytes; of any other number of bytes: empty.
std::string keyOfBytes(std::string_view bytes);

KeyPair newKeyPair();

/// In a directory of keys, the box's own.
std::filesystem::path serverKeyFile(const std::filesystem::path& directory);

/// EX_NOINPUT: cannot be read; EX_CONFIG: it is none; EX_NOPERM: others can read it.
tl::expected<KeyPair, Error> loadKeyPair(const std::filesystem::path& path);

/// A new file with mode 0600; its directory is made. EX_CANTCREAT where one is there already; EX_NOPERM where root
/// would write into somebody else's directory.
tl::expected<void, Error> saveKeyPair(const std::filesystem::path& path, const KeyPair& keys);

/// The box's own, likewise. Root's is readable by the directory's group, the gateway's.
tl::expected<void, Error> saveServerKey(const std::filesystem::path& directory, const KeyPair& keys);

/// Replaces NAME.key.
tl::expected<void, Error> allow(const std::filesystem::path& directory, const AllowedKey& key);

/// EX_NOINPUT where nobody of that name is allowed.
tl::expected<void, Error> revoke(const std::filesystem::path& directory, const std::string& name);

/// A directory's keys, looked at again and again.
class KeyDirectory {
 public:
  explicit KeyDirectory(std::filesystem::path path)
      : path_(std::move(path)) {}

  /// Reads it again if something in it has changed; true: the keys or the faults are others than before. A file that is
  /// wrong allows nobody. Where descriptors or memory are used up everything stays as it was.
  bool refresh();

  const std::vector<AllowedKey>& keys() const { return keys_; }  ///< by name
  const std::vector<Error>& faults() const { return faults_; }   ///< of its files, or of itself; as last read
  const AllowedKey* find(std::string_view key) const;

 private:
  struct Stamp {
    std::string name;
    long inode, size, seconds, nanoseconds;  ///< of its last change, that of its owner or permissions, too
    bool operator==(const Stamp&) const = default;
  };

  std::filesystem::path path_;
  bool looked_ = false;
  std::vector<Stamp> stamps_;
  std::vector<AllowedKey> keys_;
  std::vector<Error> faults_;
};

}  // namespace tractiond::gateway
