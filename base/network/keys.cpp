#include "base/network/keys.h"

#include "base/directory.h"
#include "base/toml_table.h"
#include "base/whole_file.h"
#include "proto/traction/v1/endpoints.h"

#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>
#include <utility>

namespace tractiond::network {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".key";
constexpr std::size_t kBytes = 32, kLetters = 40;  ///< of a key, binary and in Z85

using Letters = std::array<char, kLetters + 1>;

Error asError(const FileError& error) {
  return {.exitCode = error.unreadable ? EX_NOINPUT : EX_CONFIG, .what = error.what, .where = error.where};
}

std::string publicOf(const std::string& secretKey) {
  Letters letters{};
  return zmq_curve_public(letters.data(), secretKey.c_str()) == 0 ? letters.data() : "";
}

void readKey(TomlTable& file, const char* name, std::string& key) {
  file.read(name, key);
  if (!isKey(key)) file.fail(name, "is not a key: 40 letters of Z85, as tractionctl keys new prints them");
}

Error openToOthers(const fs::path& path, const std::string& what) {
  return {.exitCode = EX_NOPERM,
          .what = "every user of this machine can write into this " + what + ", so nothing in it is believed",
          .where = path.string(),
          .remedy = "chmod o-w it, and look at what it allows"};
}

tl::expected<AllowedKey, Error> loadAllowed(const fs::path& path) {
  AllowedKey allowed{.name = path.stem().string(), .key = {}};
  if (!traction::isValidName(allowed.name)) {
    return tl::unexpected(Error{.exitCode = EX_CONFIG,
                                .what = "the file's name is not a client's: 1 to 24 of A-Z, a-z, 0-9, _ and -",
                                .where = path.string()});
  }
  auto file = TomlTable::load(path.string());
  if (!file) return tl::unexpected(asError(file.error()));
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && canOthersWrite(status)) return tl::unexpected(openToOthers(path, "file"));
  readKey(*file, "key", allowed.key);
  std::string word;
  file->read("permission", word);
  if (word == wordOf(Permission::kControl)) {
    allowed.permission = Permission::kControl;
  } else if (word != wordOf(Permission::kRead)) {
    file->fail("permission", R"(must be "read" or "control")");
  }
  if (auto sound = file->finish(); !sound) return tl::unexpected(asError(sound.error()));
  return allowed;
}

Error unusable(const fs::path& path, int error) {
  const bool denied = error == EACCES || error == EPERM || error == EROFS;
  return {.exitCode = denied ? EX_NOPERM : EX_CANTCREAT,
          .what = "cannot be written: " + std::generic_category().message(error),
          .where = path.string(),
          .remedy = denied ? "keys of a box are root's to change: sudo" : ""};
}

/// Creates a directory and its parents, which all may read, whatever the umask is.
std::error_code createForAll(const fs::path& directory) {
  std::error_code error;
  const mode_t before = umask(022);
  fs::create_directories(directory, error);
  umask(before);
  return error;
}

/// Writes the whole file or nothing, with this mode whatever the umask is. Follows no link. Root's file gets the group
/// of its directory.
tl::expected<void, Error> write(const fs::path& path, const std::string& text, mode_t mode) {
  const fs::path directory = path.parent_path();
  std::error_code error;
  fs::create_directories(directory, error);
  struct stat of {};
  if (!error && stat(directory.c_str(), &of) != 0) error.assign(errno, std::generic_category());
  const mode_t before = umask(0);
  if (!error) error = replaceWholeFile(path, text, mode);
  umask(before);
  if (error) return tl::unexpected(unusable(path, error.value()));
  if (geteuid() == 0 && lchown(path.c_str(), 0, of.st_gid) != 0) return tl::unexpected(unusable(path, errno));
  return {};
}

/// Returns whether others than the owner can read the file; the group of root's file, which is the gateway's, may.
bool canOthersRead(const struct stat& of) {
  return (of.st_mode & (of.st_uid == 0 ? 037 : 077)) != 0;
}

}  // namespace

std::string_view wordOf(Permission permission) {
  return permission == Permission::kControl ? "control" : "read";
}

bool isKey(std::string_view text) {
  std::array<std::uint8_t, kBytes> bytes{};
  return text.size() == kLetters && zmq_z85_decode(bytes.data(), std::string(text).c_str()) != nullptr;
}

std::string keyOfBytes(std::string_view bytes) {
  if (bytes.size() != kBytes) return "";
  Letters letters{};
  zmq_z85_encode(letters.data(), reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  return letters.data();
}

KeyPair newKeyPair() {
  Letters publicKey{}, secretKey{};
  do {
    zmq_curve_keypair(publicKey.data(), secretKey.data());
  } while (publicKey[0] == '-');  // a command line would take it for an option
  return {.publicKey = publicKey.data(), .secretKey = secretKey.data(), .serverKey = {}};
}

fs::path serverKeyFile(const fs::path& directory) {
  return directory / "gateway.secret";
}

tl::expected<KeyPair, Error> loadKeyPair(const fs::path& path) {
  auto file = TomlTable::load(path.string());
  if (!file) return tl::unexpected(asError(file.error()));
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && canOthersRead(status)) {
    return tl::unexpected(Error{.exitCode = EX_NOPERM,
                                .what = "others can read this secret key",
                                .where = path.string(),
                                .remedy = "chmod 600 it, or better make a new one"});
  }
  KeyPair keys;
  readKey(*file, "public", keys.publicKey);
  readKey(*file, "secret", keys.secretKey);
  if (file->has("server")) readKey(*file, "server", keys.serverKey);
  if (auto sound = file->finish(); !sound) return tl::unexpected(asError(sound.error()));
  if (publicOf(keys.secretKey) == keys.publicKey) return keys;
  return tl::unexpected(
      Error{.exitCode = EX_CONFIG, .what = "the public key does not belong to the secret one", .where = path.string()});
}

namespace {

tl::expected<void, Error> save(const fs::path& path, const KeyPair& keys, mode_t mode) {
  std::error_code ignored;
  if (fs::exists(fs::symlink_status(path, ignored))) {
    return tl::unexpected(Error{.exitCode = EX_CANTCREAT,
                                .what = "there is a file already",
                                .where = path.string(),
                                .remedy = "a key is not replaced: remove it first, or choose another file"});
  }
  std::string text = "# Keep this file secret: it is the proof of your identity.\npublic = \"" + keys.publicKey +
                     "\"\nsecret = \"" + keys.secretKey + "\"\n";
  if (!keys.serverKey.empty()) text += "server = \"" + keys.serverKey + "\"\n";
  return write(path, text, mode);
}

}  // namespace

tl::expected<void, Error> saveKeyPair(const fs::path& path, const KeyPair& keys) {
  return save(path, keys, 0600);
}

tl::expected<void, Error> saveServerKey(const fs::path& directory, const KeyPair& keys) {
  if (const auto error = createForAll(directory)) return tl::unexpected(unusable(directory, error.value()));
  return save(serverKeyFile(directory), keys, geteuid() == 0 ? 0640 : 0600);
}

tl::expected<void, Error> allow(const fs::path& directory, const AllowedKey& key) {
  if (const auto error = createForAll(directory)) return tl::unexpected(unusable(directory, error.value()));
  const std::string text = "key = \"" + key.key + "\"\npermission = \"" + std::string(wordOf(key.permission)) + "\"\n";
  return write(directory / (key.name + std::string(kEnding)), text, 0644);
}

tl::expected<void, Error> revoke(const fs::path& directory, const std::string& name) {
  const fs::path path = directory / (name + std::string(kEnding));
  if (unlink(path.c_str()) == 0) return {};
  if (errno != ENOENT) return tl::unexpected(unusable(path, errno));
  return tl::unexpected(Error{.exitCode = EX_NOINPUT,
                              .what = "no client \"" + name + "\" is allowed",
                              .where = directory.string(),
                              .remedy = "tractionctl keys list prints the allowed clients"});
}

bool KeyDirectory::refresh() {
  std::vector<Stamp> now;
  std::error_code error;
  for (fs::directory_iterator entry(path_, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (!name.ends_with(kEnding)) continue;
    struct stat of {};
    stat(entry->path().c_str(), &of);  // if that fails, so will the reading
    now.push_back(
        {name, static_cast<long>(of.st_ino), static_cast<long>(of.st_size), of.st_ctim.tv_sec, of.st_ctim.tv_nsec});
  }
  std::optional<Error> failure;
  struct stat own {};
  if (error) {
    failure = Error{.exitCode = EX_NOINPUT,
                    .what = "the directory of keys cannot be read: " + error.message(),
                    .where = path_.string()};
  } else if (stat(path_.c_str(), &own) == 0 && canOthersWrite(own)) {
    failure = openToOthers(path_, "directory of keys");
  }
  if (failure) now.clear();
  std::ranges::sort(now, {}, &Stamp::name);
  if (!failure && listed_ && now == stamps_) return false;
  listed_ = !failure;

  std::vector<AllowedKey> keys;
  std::vector<Error> faults;
  if (failure) faults.push_back(*failure);
  for (const Stamp& stamp : now) {
    auto allowed = loadAllowed(path_ / stamp.name);
    if (allowed && std::ranges::find(keys, allowed->key, &AllowedKey::key) != keys.end()) {
      allowed = tl::unexpected(Error{.exitCode = EX_CONFIG,
                                     .what = "has the same key as another file, and is passed over",
                                     .where = (path_ / stamp.name).string()});
    }
    if (allowed)
      keys.push_back(*std::move(allowed));
    else
      faults.push_back(std::move(allowed).error());
  }
  // A file that could not be read, perhaps for lack of a descriptor, is read again next time.
  if (std::ranges::any_of(faults, [](const Error& fault) { return fault.exitCode == EX_NOINPUT; })) listed_ = false;
  const bool changed = keys != keys_ || !std::ranges::equal(faults, faults_, {}, &Error::message, &Error::message);
  stamps_ = std::move(now);
  keys_ = std::move(keys);
  faults_ = std::move(faults);
  return changed;
}

const AllowedKey* KeyDirectory::find(std::string_view key) const {
  const auto found = std::ranges::find(keys_, key, &AllowedKey::key);
  return found == keys_.end() ? nullptr : &*found;
}

}  // namespace tractiond::network
