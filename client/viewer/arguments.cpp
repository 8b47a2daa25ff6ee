#include "client/viewer/arguments.h"

#include "client/files/keys.h"
#include "manual/parse.h"
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

const std::string kFoxgloveAddress = "127.0.0.1:8765";

tl::unexpected<int> failed(const std::string& what) {
  std::cerr << "traction-view: " << what << '\n';
  return tl::unexpected<int>(EX_USAGE);
}

/// The command line as it was given.
struct CommandLine {
  std::vector<std::string> instances, streams, controls;
  std::string listen = "127.0.0.1:9880", foxglove = kFoxgloveAddress, keyFile, serverKey;
  bool insecure = false, latest = false;
  ServerOptions server;
  FoxgloveOptions foxgloveServer;
};

void addSources(CLI::App& app, CommandLine& line) {
  app.add_option("--instance", line.instances,
                 "instance of tractiond on this machine; may be repeated; without: default")
      ->type_name("INSTANCE");
  app.add_option("--connect", line.streams, "ZeroMQ endpoint of a stream, instead of an instance; may be repeated")
      ->type_name("ENDPOINT");
  app.add_option("--control", line.controls, "ZeroMQ endpoint for requests, one for each --connect")
      ->type_name("ENDPOINT");
  app.add_option("--key", line.keyFile, "file of your key for a gateway; without: ~/.config/traction/key")
      ->type_name("FILE");
  app.add_option("--server-key", line.serverKey, "public key of the gateway, as tractionctl keys prints it on its host")
      ->type_name("KEY");
  app.add_flag("--latest", line.latest, "--connect names the endpoint 'latest': fields alone, for slow lines");
}

void addServer(CLI::App& app, CommandLine& line) {
  app.add_option("--listen", line.listen,
                 "ADDRESS:PORT, or one of them, at which the page is served; port 0 is any free port")
      ->type_name("ADDRESS")
      ->capture_default_str();
  auto* foxglove =
      app.add_option(
             "--foxglove", line.foxglove,
             "serve the Foxglove WebSocket protocol too, for Foxglove and Lichtblick, at ADDRESS:PORT or one of "
             "them; without a value at the default")
          ->type_name("ADDRESS")
          ->expected(0, 1)
          ->capture_default_str();
  app.add_option("--foxglove-origin", line.foxgloveServer.origins,
                 "origin of pages that may connect to --foxglove besides Foxglove's and Lichtblick's own, such as "
                 "http://localhost:8080 for a Lichtblick of your own; may be repeated")
      ->type_name("ORIGIN")
      ->needs(foxglove);
  app.add_flag(
      "--insecure", line.insecure,
      "listen beyond this machine's loopback: every host that reaches the address reads everything and, without "
      "--read-only, sets the zero; nothing is encrypted");
  app.add_option("--name", line.server.names, "name of this host that clients may use; may be repeated")
      ->type_name("HOST");
  app.add_flag("--read-only", line.server.readOnly, "refuse browsers' requests for a zero and for recordings");
  app.add_option("--setup", line.server.setup,
                 "folder of the guided setup of a gel, for the page's button 'Set up'; it is made if it does not exist")
      ->type_name("FOLDER");
  app.add_option("--recordings", line.server.recordings,
                 "directory of the recordings that browsers may play, and for those that they make")
      ->type_name("DIRECTORY")
      ->check(CLI::ExistingDirectory);
}

/// Reads the value of an option that is an address to listen at.
tl::expected<ListenAddress, int> listenAt(const char* option, const std::string& text, const ListenAddress& usual,
                                          bool insecure) {
  auto at = parseListenAddress(text, usual);
  if (!at) return failed(std::string(option) + ": '" + text + "' is not ADDRESS:PORT");
  const std::string address = resolved(at->address);
  if (address.empty()) return failed(std::string(option) + ": '" + at->address + "' is no address and no known name");
  at->address = address;
  if (isLoopback(address) || insecure) return *at;
  return failed(std::string(option) + ": '" + address +
                "' can be reached from other hosts, without keys and encryption; --insecure permits it. An SSH tunnel "
                "to the loopback does not need it");
}

tl::expected<std::vector<SourceOptions>, int> sourcesOf(const CommandLine& line) {
  if (line.controls.size() > line.streams.size()) return failed("there are more --control than --connect");
  const Keys keys =
      line.keyFile.empty() && line.serverKey.empty() ? Keys() : client::keysFor(line.serverKey, line.keyFile);
  std::vector<std::string> instances = line.instances;
  if (instances.empty() && line.streams.empty()) instances.emplace_back(kDefaultInstance);
  std::vector<SourceOptions> sources;
  for (const std::string& name : instances) {
    if (!isValidName(name)) return failed("'" + name + "' is not an instance's name: 1 to 24 of A-Z a-z 0-9 _ -");
    SourceOptions source{.name = name, .subscription = {}, .control = ControlOptions()};
    source.subscription.instance = source.control->instance = name;
    sources.push_back(source);
  }
  for (std::size_t i = 0; i < line.streams.size(); ++i) {
    const std::string& stream = line.streams[i];
    if (stream.find("://") == std::string::npos) {
      return failed("'" + stream + "' is not an endpoint: tcp://HOST:PORT or ipc:///PATH");
    }
    SourceOptions source{.name = stream, .subscription = {}, .control = std::nullopt};
    source.subscription.endpoint = stream;
    source.subscription.mode = line.latest ? Mode::kLatest : Mode::kStream;
    source.subscription.keys = keys;
    if (i < line.controls.size()) {
      source.control.emplace();
      source.control->endpoint = line.controls[i];
      source.control->keys = keys;
    }
    sources.push_back(source);
  }
  return sources;
}

}  // namespace

tl::expected<Arguments, int> parseArguments(int argc, char** argv) {
  CommandLine line;
  CLI::App app("Shows what tractiond measures in a browser.", "traction-view");
  app.set_version_flag("--version", "traction-view " TRACTION_VERSION);
  app.footer(kExitCodes);
  addSources(app, line);
  addServer(app, line);
  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  Arguments arguments{.server = line.server, .sources = {}};
  const auto page = listenAt("--listen", line.listen, line.server.listen, line.insecure);
  if (!page) return tl::unexpected(page.error());
  arguments.server.listen = *page;
  if (app.count("--foxglove") > 0) {
    const std::string& text = line.foxglove.empty() ? kFoxgloveAddress : line.foxglove;
    const auto at = listenAt("--foxglove", text, line.foxgloveServer.listen, line.insecure);
    if (!at) return tl::unexpected(at.error());
    arguments.server.foxglove = line.foxgloveServer;
    arguments.server.foxglove->listen = *at;
  }
  auto sources = sourcesOf(line);
  if (!sources) return tl::unexpected(sources.error());
  arguments.sources = *std::move(sources);
  if (!arguments.server.setup.empty() && (arguments.sources.size() != 1 || !arguments.sources[0].control)) {
    return failed("--setup sets up one sensor, whose requests it can reach (--instance, or --connect with --control)");
  }
  if (!arguments.server.setup.empty() && arguments.server.readOnly)
    return failed("--setup and --read-only exclude each other");
  return arguments;
}

}  // namespace traction::view
