#include "client/touch/arguments.h"

#include "client/files/file_error.h"
#include "client/files/keys.h"
#include "manual/describe.h"
#include "manual/parse.h"
#include "proto/traction/v1/endpoints.h"

#include <CLI/CLI.hpp>
#include <sysexits.h>

#include <iostream>
#include <string>

namespace traction::contacts {
namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked
  64  the command line is wrong
  66  the file of the key, or of the hand, cannot be read
  69  an address is in use
  71  the operating system refuses something
  73  a directory or socket cannot be made
  75  another traction-touch has this instance
  77  no permission
  78  the file of the key, or of the hand, is wrong)";

tl::unexpected<int> failed(int exitCode, const std::string& what) {
  std::cerr << "traction-touch: " << what << '\n';
  return tl::unexpected<int>(exitCode);
}

}  // namespace

tl::expected<Arguments, int> parseArguments(int argc, char** argv) {
  Arguments arguments;
  std::string keyFile, serverKey;
  CLI::App app(
      "Follows the contacts of a tractiond from frame to frame, or joins several to a hand, and publishes that.",
      "traction-touch");
  CLI::Option* hand =
      app.add_option("--hand", arguments.hand,
                     "file of a hand: joins the fields of its fingers, instances on this machine, to grasps; the "
                     "sockets have the name of the hand")
          ->type_name("FILE");
  app.add_option("--instance", arguments.source.instance, "name of a tractiond on this machine, and of the sockets")
      ->type_name("INSTANCE")
      ->capture_default_str()
      ->check([](const std::string& name) {
        return isValidName(name) ? "" : "\"" + name + "\" is not a name: 1 to 24 of A-Z, a-z, 0-9, _ and - are";
      })
      ->excludes(hand);
  app.add_option("--connect", arguments.source.endpoint, "ZeroMQ endpoint of the stream, instead of the instance's")
      ->type_name("ENDPOINT")
      ->excludes(hand);
  app.add_option("--key", keyFile, "file of your key for a gateway; without: ~/.config/traction/key")
      ->type_name("FILE");
  app.add_option("--server-key", serverKey, "public key of the gateway, as tractionctl keys prints it on its host")
      ->type_name("KEY");
  app.add_option("--runtime", arguments.runtime, "directory of the sockets")->type_name("DIR");
  app.set_version_flag("--version", "traction-touch " TRACTION_VERSION);
  app.footer(kExitCodes);
  manual::describable(app);
  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  try {
    if (!keyFile.empty() || !serverKey.empty()) arguments.source.keys = client::keysFor(serverKey, keyFile);
  } catch (const client::FileError& error) {
    return failed(error.exitCode(), error.what());
  } catch (const Error& error) {
    return failed(EX_CONFIG, error.what());
  }
  arguments.source.topics = kField | kDescription;
  return arguments;
}

}  // namespace traction::contacts
