#include "client/viewer/arguments.h"

#include "client/cli/keys.h"
#include "manual/describe.h"
#include "proto/traction/v1/endpoints.h"

#include <CLI/CLI.hpp>
#include <sysexits.h>

#include <iostream>

namespace traction::view {
namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked
  64  the command line is wrong
  69  a port is in use
  78  a file of keys is wrong)";

tl::unexpected<int> failed(const std::string& what) {
  std::cerr << "traction-view: " << what << '\n';
  return tl::unexpected<int>(EX_USAGE);
}

/// Returns why a server may not listen at an address; empty if it may.
std::string refusal(const ListenAddress& at, bool insecure) {
  if (isLoopback(at.address) || insecure) return {};
  return "'" + at.address +
         "' can be reached from other hosts, without keys and encryption; --insecure permits it. An SSH tunnel to the "
         "loopback does not need it";
}

}  // namespace

tl::expected<Arguments, int> parseArguments(int argc, char** argv) {
  std::vector<std::string> instances, streams, controls;
  std::string listen = "127.0.0.1:9880", foxglove = "127.0.0.1:8765", keyFile, serverKey;
  bool insecure = false, latest = false;
  Arguments arguments;
  ServerOptions& server = arguments.server;
  FoxgloveOptions foxgloveServer;

  CLI::App app("Shows what tractiond measures in a browser.", "traction-view");
  app.set_version_flag("--version", "traction-view " TRACTION_VERSION);
  app.footer(kExitCodes);
  manual::describable(app);
  app.add_option("--instance", instances, "instance of tractiond on this machine; may be repeated; without: default")
      ->type_name("INSTANCE");
  app.add_option("--connect", streams, "ZeroMQ endpoint of a stream, instead of an instance; may be repeated")
      ->type_name("ENDPOINT");
  app.add_option("--control", controls, "ZeroMQ endpoint for requests, one for each --connect")->type_name("ENDPOINT");
  app.add_option("--key", keyFile, "file of your key for a gateway; without: ~/.config/traction/key")
      ->type_name("FILE");
  app.add_option("--server-key", serverKey, "public key of the gateway, as tractionctl keys prints it on its host")
      ->type_name("KEY");
  app.add_flag("--latest", latest, "--connect names the endpoint 'latest': fields alone, for slow lines");
  app.add_option("--listen", listen,
                 "ADDRESS:PORT, or one of them, at which the page is served; port 0 is any free port")
      ->type_name("ADDRESS")
      ->capture_default_str();
  auto* foxgloveOption =
      app.add_option(
             "--foxglove", foxglove,
             "serve the Foxglove WebSocket protocol too, for Foxglove and Lichtblick, at ADDRESS:PORT or one of "
             "them; without a value at the default")
          ->type_name("ADDRESS")
          ->expected(0, 1)
          ->capture_default_str();
  app.add_option("--foxglove-origin", foxgloveServer.origins,
                 "origin of pages that may connect to --foxglove besides Foxglove's and Lichtblick's own, such as "
                 "http://localhost:8080 for a Lichtblick of your own; may be repeated")
      ->type_name("ORIGIN")
      ->needs(foxgloveOption);
  app.add_flag(
      "--insecure", insecure,
      "listen beyond this machine's loopback: every host that reaches the address reads everything and, without "
      "--read-only, sets the zero; nothing is encrypted");
  app.add_option("--name", server.names, "name of this host that clients may use; may be repeated")->type_name("HOST");
  app.add_flag("--read-only", server.readOnly, "refuse browsers' requests for a zero and for recordings");
  app.add_option("--recordings", server.recordings,
                 "directory of the recordings that browsers may play, and for those that they make")
      ->type_name("DIRECTORY")
      ->check(CLI::ExistingDirectory);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& stop) {
    if (stop.get_exit_code() == 0) return tl::unexpected(app.exit(stop));  // help, version
    return failed(std::string(stop.what()) + "; see traction-view --help");
  }
  const auto listenAt = parseListenAddress(listen, server.listen);
  if (!listenAt) return failed("--listen: '" + listen + "' is not ADDRESS:PORT");
  server.listen = *listenAt;
  if (const std::string why = refusal(server.listen, insecure); !why.empty()) return failed("--listen: " + why);
  if (foxgloveOption->count() > 0) {
    const auto at = foxglove.empty() ? foxgloveServer.listen : parseListenAddress(foxglove, foxgloveServer.listen);
    if (!at) return failed("--foxglove: '" + foxglove + "' is not ADDRESS:PORT");
    foxgloveServer.listen = *at;
    if (const std::string why = refusal(*at, insecure); !why.empty()) return failed("--foxglove: " + why);
    server.foxglove = foxgloveServer;
  }
  if (controls.size() > streams.size()) return failed("there are more --control than --connect");

  Keys keys;
  if (!keyFile.empty() || !serverKey.empty()) keys = cli::keysFor(serverKey, keyFile);
  if (instances.empty() && streams.empty()) instances.emplace_back(kDefaultInstance);
  for (const std::string& name : instances) {
    if (!isValidName(name)) return failed("'" + name + "' is not an instance's name: 1 to 24 of A-Z a-z 0-9 _ -");
    SourceOptions source{.name = name, .subscription = {}, .control = ControlOptions()};
    source.subscription.instance = source.control->instance = name;
    arguments.sources.push_back(source);
  }
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (streams[i].find("://") == std::string::npos) {
      return failed("'" + streams[i] + "' is not an endpoint: tcp://HOST:PORT or ipc:///PATH");
    }
    SourceOptions source{.name = streams[i], .subscription = {}, .control = std::nullopt};
    source.subscription.endpoint = streams[i];
    source.subscription.mode = latest ? Mode::kLatest : Mode::kStream;
    source.subscription.keys = keys;
    if (i < controls.size()) {
      source.control.emplace();
      source.control->endpoint = controls[i];
      source.control->keys = keys;
    }
    arguments.sources.push_back(source);
  }
  return arguments;
}

}  // namespace traction::view
