#include "client/cli/keys.h"

#include "base/network/keys.h"
#include "client/cli/output.h"
#include "proto/traction/v1/endpoints.h"

#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>

namespace traction::cli {

namespace {

namespace fs = std::filesystem;
namespace files = tractiond::network;

template <typename Result>
Result orThrow(tl::expected<Result, tractiond::Error> result) {
  if (!result) throw KeyError(result.error().exitCode, result.error().message());
  if constexpr (!std::is_void_v<Result>) return *std::move(result);
}

void checkName(const std::string& name) {
  if (isValidName(name)) return;
  throw KeyError(EX_USAGE, "'" + name + "' is no name for a key: 1 to 24 of A-Z a-z 0-9 _ - are");
}

/// Quotes a key for a shell: Z85 has no single quote, but many characters that a shell interprets.
std::string quoted(const std::string& key) {
  return "'" + key + "'";
}

std::string hostName() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 && name[0] != '\0' ? name.data() : "HOST";
}

/// Returns the keys, and prints the faults of their files on standard error.
files::KeyDirectory directoryOf(const fs::path& path) {
  files::KeyDirectory directory(path);
  directory.refresh();
  return directory;
}

/// Checks that a key of this name has an effect once it is in the directory. \throws KeyError otherwise
void checkRoom(const files::KeyDirectory& known, const fs::path& directory, const std::string& name) {
  std::error_code ignored;
  if (!fs::exists(directory, ignored)) return;
  std::size_t count = known.keys().size();
  for (const tractiond::Error& fault : known.faults()) {
    if (fault.where == directory.string()) throw KeyError(fault.exitCode, fault.message());
    ++count;  // each other one is of one file
  }
  if (count < files::kMostKeys || fs::exists(directory / (name + ".key"), ignored)) return;
  throw KeyError(EX_CONFIG, std::to_string(count) + " keys are in " + directory.string() +
                                ", and with more none is taken; tractionctl keys revoke NAME removes one");
}

}  // namespace

fs::path usualKeyFile() {
  const auto absolute = [](const char* variable) -> fs::path {
    const char* const value = std::getenv(variable);
    return value != nullptr && *value == '/' ? value : "";
  };
  fs::path base = absolute("XDG_CONFIG_HOME");
  if (base.empty()) base = absolute("HOME") / ".config";
  return base / "traction" / "key";
}

void newKey(const std::string& name, const fs::path& file) {
  checkName(name);
  const auto keys = files::newKeyPair();
  orThrow(files::saveKeyPair(file, keys));
  printLine("sudo tractionctl keys allow " + name + " " + quoted(keys.publicKey));
}

void allowKey(const fs::path& directory, const std::string& name, const std::string& key, bool control) {
  checkName(name);
  if (!files::isKey(key)) {
    throw KeyError(EX_USAGE, "'" + key + "' is not a key: 40 letters of Z85; in a shell they stand in single quotes");
  }
  const auto known = directoryOf(directory);
  if (const auto* same = known.find(key); same != nullptr && same->name != name) {
    throw KeyError(EX_DATAERR, "this key is \"" + same->name + "\"'s; tractionctl keys revoke " + same->name +
                                   " takes it from there");
  }
  checkRoom(known, directory, name);
  const fs::path own = files::serverKeyFile(directory);
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(own, ignored))) orThrow(files::saveServerKey(directory, files::newKeyPair()));
  const auto server = orThrow(files::loadKeyPair(own));  // where it is faulty, no client can connect
  orThrow(files::allow(directory, {name, key, control ? files::Permission::kControl : files::Permission::kRead}));
  printLine("tractionctl watch --host " + hostName() + " --server-key " + quoted(server.publicKey));
}

void revokeKey(const fs::path& directory, const std::string& name) {
  checkName(name);
  orThrow(files::revoke(directory, name));
}

void listKeys(const fs::path& directory, bool json) {
  const auto known = directoryOf(directory);
  const auto server = files::loadKeyPair(files::serverKeyFile(directory));
  // No letter of Z85, a name or a word needs an escape in JSON.
  if (json) {
    std::string text = R"({"server_key":")" + (server ? server->publicKey : "") + R"(","allowed":[)";
    for (const auto& one : known.keys()) {
      text += (text.back() == '[' ? R"({"name":")" : R"(,{"name":")") + one.name + R"(","permission":")" +
              std::string(wordOf(one.permission)) + R"(","key":")" + one.key + R"("})";
    }
    printLine(text + "]}");
  } else {
    if (server) printLine("this box's key is " + quoted(server->publicKey));
    for (const auto& one : known.keys()) {
      const std::string word(wordOf(one.permission));
      printLine(one.name + std::string(25 - one.name.size(), ' ') + word + std::string(8 - word.size(), ' ') +
                quoted(one.key));
    }
  }
  if (!known.faults().empty()) throw KeyError(known.faults()[0].exitCode, known.faults()[0].message());
  if (!server) throw KeyError(server.error().exitCode, server.error().message());
}

Keys keysFor(const std::string& serverKey, const fs::path& file) {
  std::error_code ignored;
  const fs::path from = file.empty() ? usualKeyFile() : file;
  if (file.empty() && serverKey.empty() && !fs::exists(from, ignored)) return {};
  if (file.empty() && !fs::exists(from, ignored)) {
    throw KeyError(EX_NOINPUT,
                   "there is no key of yours in " + from.string() + "; tractionctl keys new NAME makes one");
  }
  Keys keys = loadKeys(from.string());
  if (!serverKey.empty()) keys.serverKey = serverKey;
  if (keys.serverKey.empty()) {  // otherwise the connection would be unencrypted, to any program that answers
    throw KeyError(EX_USAGE, "the box's key is missing: --server-key KEY, or a line server = \"KEY\" in " +
                                 from.string() + "; a host that asks for none is reached by --connect and --control");
  }
  return keys;
}

}  // namespace traction::cli
