#include "client/cli/keys.h"

#include "base/network/keys.h"
#include "client/tractionctl/commands.h"
#include "client/tractionctl/exit_codes.h"
#include "client/tractionctl/parsing.h"

#include <sysexits.h>

#include <memory>

namespace traction::cli {

namespace {

struct KeysLine {
  CLI::App *keys = nullptr, *create = nullptr, *allow = nullptr, *revoke = nullptr, *list = nullptr;
  std::string name, key;
  std::filesystem::path directory = tractiond::network::kKeyDirectory;
  bool control = false, json = false;
};

int run(const KeysLine& given, const std::filesystem::path& file) {
  if (given.keys->get_subcommands().empty()) {
    return fail(EX_USAGE, "missing command, one of " + namesOf(*given.keys) + "; see tractionctl keys --help");
  }
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
  options->keys = &keys;
  options->create = keys.add_subcommand(
      "new", "Creates your key pair, and prints the command that allows it on the gateway's machine");
  options->allow =
      keys.add_subcommand("allow", "On the gateway's machine: allows a client key, and prints how its owner connects");
  options->revoke =
      keys.add_subcommand("revoke", "On the gateway's machine: revokes a client key and closes its connections");
  options->list = keys.add_subcommand(
      "list", "On the gateway's machine: prints its own key, and the allowed keys with their permissions");
  keys.require_subcommand(0, 1);
  for (CLI::App* one : {options->create, options->allow, options->revoke})
    one->add_option("name", options->name, "name of a person or a program")->required();
  options->allow->add_option("key", options->key, "public key, in single quotes")->required();
  options->allow->add_flag("--control", options->control,
                           "also allows zero, calibrate and camera, instead of reading only");
  options->list->add_flag("--json", options->json, "as JSON");
  for (CLI::App* one : {options->allow, options->revoke, options->list}) {
    one->add_option("--directory", options->directory, "directory of the keys")
        ->type_name("DIR")
        ->capture_default_str();
  }
}

}  // namespace traction::cli
