#include "gateway/arguments.h"

#include "manual/parse.h"
#include "proto/traction/v1/endpoints.h"

#include <CLI/CLI.hpp>

namespace tractiond::gateway {
namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked
  64  the command line is wrong
  66  a file cannot be read
  69  an address is in use
  71  the operating system refuses something
  77  no permission, or others can read the secret key
  78  the configuration is wrong, or a key is missing)";

}  // namespace

tl::expected<Arguments, int> parseArguments(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Lets peers on the network, by their keys, read and control a tractiond of this host.",
               "traction-gateway");
  app.add_option("--instance", arguments.instance, "of tractiond")
      ->type_name("INSTANCE")
      ->capture_default_str()
      ->check([](const std::string& name) {
        return traction::isValidName(name) ? ""
                                           : "\"" + name + "\" is not a name: 1 to 24 of A-Z, a-z, 0-9, _ and - are";
      });
  app.add_option("--config", arguments.config,
                 "configuration file; default /etc/tractiond/gateway/INSTANCE.toml if it is there")
      ->type_name("FILE");
  app.add_option("--runtime", arguments.runtime, "directory of the instance's sockets")->type_name("DIR");
  app.add_flag("--check-config", arguments.checkConfig, "check the configuration, and exit");
  app.add_flag("--print-config", arguments.printConfig, "print the configuration with every key, and exit");
  app.set_version_flag("--version", std::string("traction-gateway " TRACTIOND_VERSION));
  app.footer(kExitCodes);
  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  return arguments;
}

}  // namespace tractiond::gateway
