// Keys as files: the keys that may connect, and the secret keys of a gateway and of a client. Shared by the gateway,
// tractionctl and the client library. Keys are CURVE keys, 40 characters of Z85. The functions are reentrant;
// those that write change the umask of the process meanwhile.
#pragma once

#include "base/error.h"

#include <tl/expected.hpp>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::network {

inline constexpr const char* kKeyDirectory = "/etc/tractiond/keys";

enum class Permission {
  kRead,     ///< may subscribe to stream and latest
  kControl,  ///< may also subscribe to previews and send requests: zero, calibration, camera
};

/// Returns "read" or "control".
std::string_view wordOf(Permission permission);

/// A client key that may connect, stored in the file NAME.key.
struct AllowedKey {
  std::string name;  ///< 1 to 24 of A-Z, a-z, 0-9, _ and -
  std::string key;   ///< public key of the client
  Permission permission = Permission::kRead;

  bool operator==(const AllowedKey&) const = default;
};

/// Keys of a gateway or of a client.
struct KeyPair {
  std::string publicKey, secretKey;
  std::string serverKey;  ///< of the gateway that it connects to; empty: not known
};

/// Returns whether `text` is a key: 40 characters of Z85.
bool isKey(std::string_view text);

/// Returns the text (Z85) of a key given as 32 bytes; empty for any other number of bytes.
std::string keyOfBytes(std::string_view bytes);

/// Generates a random key pair. The public key never begins with '-', so that it can be a command-line argument.
KeyPair newKeyPair();

/// Returns the path of the gateway's own secret key in a directory of keys: DIRECTORY/gateway.secret, whether or not it
/// exists.
std::filesystem::path serverKeyFile(const std::filesystem::path& directory);

/// Reads a key pair. Errors: EX_NOINPUT if it cannot be read, EX_CONFIG if it is not a valid pair (the public key must
/// belong to the secret one), EX_NOPERM if the file's mode lets others than its owner read, write or execute it; the
/// group of a file of root may read it.
tl::expected<KeyPair, Error> loadKeyPair(const std::filesystem::path& path);

/// Writes a new file with mode 0600 and creates its directory and that one's parents. Errors: EX_CANTCREAT if the file
/// exists or cannot be written, EX_NOPERM without the permission. As root, the file gets the group of its directory.
/// The mode does not depend on the process's umask. Does not check the keys. Waits for the disk.
/// \param path must state a directory: a bare file name fails with EX_CANTCREAT
tl::expected<void, Error> saveKeyPair(const std::filesystem::path& path, const KeyPair& keys);

/// Writes the gateway's own key to serverKeyFile() as saveKeyPair() does, with the same errors. As root the mode is
/// 0640, so that the directory's group, the gateway's, can read it. The directories that it creates have mode 0755.
tl::expected<void, Error> saveServerKey(const std::filesystem::path& directory, const KeyPair& keys);

/// Writes NAME.key with mode 0644 and creates the directory as saveServerKey() does; replaces an existing file as a
/// whole. Errors and group are those of saveKeyPair(), except for an existing file.
/// \param key must be valid: name and key are not checked
tl::expected<void, Error> allow(const std::filesystem::path& directory, const AllowedKey& key);

/// Deletes NAME.key; a gateway notices it by itself (KeyDirectory::refresh()). Errors: EX_NOINPUT if there is none;
/// EX_NOPERM or EX_CANTCREAT if it cannot be deleted.
/// \param name must be valid: it is not checked
tl::expected<void, Error> revoke(const std::filesystem::path& directory, const std::string& name);

/// The keys of a directory, as refresh() has read them last. Not thread-safe.
class KeyDirectory {
 public:
  /// Reads nothing: until the first refresh() there are no keys.
  explicit KeyDirectory(std::filesystem::path path)
      : path_(std::move(path)) {}

  /// Reads the directory in the first call, and again if a file NAME.key has changed, appeared or gone, or could not be
  /// read. Returns whether the keys or the faults have changed. A faulty file allows no key, nor does one with the key
  /// of a file before it in the order of names. No key is allowed if the directory cannot be read, or can be written by
  /// every user. Waits for the disk.
  bool refresh();

  /// Returns the allowed keys, sorted by the names of their files. Valid until the next refresh().
  const std::vector<AllowedKey>& keys() const { return keys_; }
  /// Returns the errors of single files or of the directory, at the last reading. Valid until the next refresh().
  const std::vector<Error>& faults() const { return faults_; }
  /// Returns the allowed key equal to `key`, or null. Valid until the next refresh().
  const AllowedKey* find(std::string_view key) const;

 private:
  struct Stamp {
    std::string name;
    long inode, size, seconds, nanoseconds;  ///< of the inode's last change, which includes its owner and mode
    bool operator==(const Stamp&) const = default;
  };

  std::filesystem::path path_;
  bool listed_ = false;
  std::vector<Stamp> stamps_;
  std::vector<AllowedKey> keys_;
  std::vector<Error> faults_;
};

}  // namespace tractiond::network
