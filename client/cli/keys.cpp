// Manages the keys for gateways.
#include "base/network/keys.h"

#include "base/json_writer.h"
#include "client/cli/commands.h"
#include "client/files/failure.h"
#include "client/files/keys.h"
#include "client/show/output.h"
#include "proto/traction/v1/endpoints.h"

#include <sysexits.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <memory>
#include <string>

namespace traction::client {

namespace {

namespace fs = std::filesystem;
namespace files = tractiond::network;

void checkName(const std::string& name) {
  if (isValidName(name)) return;
  throw Failure(EX_USAGE, "'" + name + "' is no name for a key: 1 to 24 of A-Z a-z 0-9 _ - are");
}

/// Quotes a key for a shell: Z85 has no single quote, but many characters that a shell interprets.
std::string shellQuoted(const std::string& key) {
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

// All functions below throw Failure: EX_USAGE for an invalid name or key; EX_NOINPUT if a file does not exist or
// cannot be read; EX_CONFIG if its content is not valid; EX_CANTCREAT if it cannot be written; EX_NOPERM without the
// permission, or if a secret file can be read by others. Those that print do so on standard output, and throw
// OutputError if it cannot be written. `directory` is the gateway's directory of keys. A name is 1 to 24 of A-Z, a-z,
// 0-9, _ and -; a key is 40 characters of Z85.

/// Writes a new random key pair into a new file with mode 0600, and creates its directories. Prints the command that
/// allows its public key under `name` on the gateway's machine.
/// \throws Failure EX_CANTCREAT also if the file exists
void newKey(const std::string& name, const fs::path& file) {
  checkName(name);
  const auto keys = files::newKeyPair();
  orThrow(files::saveKeyPair(file, keys));
  printLine("sudo tractionctl keys allow " + name + " " + shellQuoted(keys.publicKey));
}

/// Allows a key under a name: to read, or with `control` also to send requests. Replaces an earlier key of this name;
/// the gateway then ends all connections, and the clients that are still allowed connect again. Creates the gateway's
/// own key pair if there is none. Prints the command with which a client connects.
/// \throws Failure, and allows nothing: also EX_DATAERR if the key is allowed under another name, EX_NOPERM if every
/// user can write into the directory; and if the gateway's own key pair cannot be read or is faulty
void allowKey(const fs::path& directory, const std::string& name, const std::string& key, bool control) {
  checkName(name);
  if (!files::isKey(key)) {
    throw Failure(EX_USAGE, "'" + key + "' is not a key: 40 letters of Z85; in a shell they stand in single quotes");
  }
  const auto known = directoryOf(directory);
  if (const auto* same = known.find(key); same != nullptr && same->name != name) {
    throw Failure(EX_DATAERR, "this key is \"" + same->name + "\"'s; tractionctl keys revoke " + same->name +
                                  " takes it from there");
  }
  std::error_code ignored;
  for (const tractiond::Error& fault : known.faults()) {  // of the directory: the key would have no effect
    if (fault.where == directory.string() && fs::exists(directory, ignored))
      throw Failure(fault.exitCode, fault.message());
  }
  const fs::path own = files::serverKeyFile(directory);
  if (!fs::exists(fs::symlink_status(own, ignored))) orThrow(files::saveServerKey(directory, files::newKeyPair()));
  const auto server = orThrow(files::loadKeyPair(own));  // where it is faulty, no client can connect
  orThrow(files::allow(directory, {name, key, control ? files::Permission::kControl : files::Permission::kRead}));
  printLine("tractionctl watch --host " + hostName() + " --server-key " + shellQuoted(server.publicKey));
}

/// Deletes the file of the key with this name; the gateway then closes its connections. Prints nothing.
void revokeKey(const fs::path& directory, const std::string& name) {
  checkName(name);
  orThrow(files::revoke(directory, name));
}

/// Prints the gateway's public key, and the allowed keys with their permissions, as text or as one line of JSON.
/// \throws Failure only after printing: the first faulty file, or else the reason why the gateway's key cannot be
/// read
void listKeys(const fs::path& directory, bool json) {
  const auto known = directoryOf(directory);
  const auto server = files::loadKeyPair(files::serverKeyFile(directory));
  if (json) {
    JsonWriter text;
    text.open('{').key("server_key").string(server ? server->publicKey : "").key("allowed").open('[');
    for (const auto& one : known.keys()) {
      text.open('{').key("name").string(one.name).key("permission").string(wordOf(one.permission));
      text.key("key").string(one.key).close('}');
    }
    printLine(text.close(']').close('}').take());
  } else {
    if (server) printLine("this box's key is " + shellQuoted(server->publicKey));
    for (const auto& one : known.keys()) {
      const std::string word(wordOf(one.permission));
      printLine(one.name + std::string(25 - one.name.size(), ' ') + word + std::string(8 - word.size(), ' ') +
                shellQuoted(one.key));
    }
  }
  if (!known.faults().empty()) throw Failure(known.faults()[0].exitCode, known.faults()[0].message());
  orThrow(server);
}

struct KeysLine {
  CLI::App *create = nullptr, *allow = nullptr, *revoke = nullptr, *list = nullptr;
  std::string name, key;
  std::filesystem::path directory = tractiond::network::kKeyDirectory;
  bool control = false, json = false;
};

int run(const KeysLine& given, const std::filesystem::path& file) {
  if (given.create->parsed()) newKey(given.name, file.empty() ? usualKeyFile() : std::filesystem::absolute(file));
  if (given.allow->parsed()) allowKey(given.directory, given.name, given.key, given.control);
  if (given.revoke->parsed()) revokeKey(given.directory, given.name);
  if (given.list->parsed()) listKeys(given.directory, given.json);
  return EX_OK;
}

}  // namespace

void addKeys(Commands& commands) {
  const auto options = std::make_shared<KeysLine>();
  CLI::App& keys = commands.add("keys", "Manages the keys of the clients of a traction-gateway",
                                [options](const Target& target) { return run(*options, target.keyFile()); });
  options->create = keys.add_subcommand(
      "new", "Creates your key pair, and prints the command that allows it on the gateway's machine");
  options->allow =
      keys.add_subcommand("allow", "On the gateway's machine: allows a client key, and prints how its owner connects");
  options->revoke =
      keys.add_subcommand("revoke", "On the gateway's machine: revokes a client key and closes its connections");
  options->list = keys.add_subcommand(
      "list", "On the gateway's machine: prints its own key, and the allowed keys with their permissions");
  keys.require_subcommand(1);
  for (CLI::App* one : {options->create, options->allow, options->revoke})
    one->add_option("name", options->name, "name of a person or a program")->required();
  options->allow->add_option("key", options->key, "public key, in single quotes; behind -- if it begins with -")
      ->required();
  options->allow->add_flag("--control", options->control,
                           "also allows zero, calibrate and camera, instead of reading only");
  options->list->add_flag("--json", options->json, "as JSON");
  for (CLI::App* one : {options->allow, options->revoke, options->list}) {
    one->add_option("--directory", options->directory, "directory of the keys")
        ->type_name("DIR")
        ->capture_default_str();
  }
}

}  // namespace traction::client
