// traction-view: the viewer's bridge.

#include "client/cli/keys.h"
#include "client/cli/output.h"
#include "client/viewer/server.h"
#include "manual/describe.h"
#include "proto/traction/v1/endpoints.h"

#include <CLI/CLI.hpp>
#include <sysexits.h>

#include <charconv>
#include <iostream>

namespace {

using namespace traction;

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked
  64  the command line is wrong
  69  the port is in use
  78  a file of keys is wrong)";

int fail(int exitCode, const std::string& what) {
  std::cerr << "traction-view: " << what << '\n';
  return exitCode;
}

/// ADDRESS:PORT, ADDRESS or PORT; [::1]:PORT. False: none of them.
bool parseListen(const std::string& text, view::ServerOptions& options) {
  const auto port = [&](const std::string& digits) {
    const auto [end, bad] = std::from_chars(digits.data(), digits.data() + digits.size(), options.port);
    return bad == std::errc() && end == digits.data() + digits.size() && !digits.empty();
  };
  if (text.find_first_not_of("0123456789") == std::string::npos) return port(text);
  const std::size_t colon = text.rfind(':');
  const bool hasPort = colon != std::string::npos && (text.find(':') == colon || text[colon - 1] == ']');
  options.address = text.substr(0, hasPort ? colon : std::string::npos);
  if (options.address.size() > 2 && options.address.front() == '[' && options.address.back() == ']') {
    options.address = options.address.substr(1, options.address.size() - 2);
  }
  return !hasPort || port(text.substr(colon + 1));
}

}  // namespace

int main(int argc, char** argv) try {
  std::vector<std::string> instances, streams, controls;
  std::string listen = "127.0.0.1:9880", keyFile, serverKey;
  bool insecure = false, latest = false;
  view::ServerOptions server;

  CLI::App app("Shows what tractiond measures in a browser.", "traction-view");
  app.set_version_flag("--version", "traction-view " TRACTION_VERSION);
  app.footer(kExitCodes);
  manual::describable(app);
  app.add_option("--instance", instances, "of tractiond on this machine; may be given again; without: default")
      ->type_name("INSTANCE");
  app.add_option("--connect", streams, "ZeroMQ endpoint of a stream, instead of an instance; may be given again")
      ->type_name("ENDPOINT");
  app.add_option("--control", controls, "ZeroMQ endpoint for requests, one for each --connect")->type_name("ENDPOINT");
  app.add_option("--key", keyFile, "file of your key for a gateway; without: ~/.config/traction/key")
      ->type_name("FILE");
  app.add_option("--server-key", serverKey, "of the gateway, as tractionctl keys tells it on its box")
      ->type_name("KEY");
  app.add_flag("--latest", latest, "--connect is to the endpoint 'latest': fields alone, for slow lines");
  app.add_option("--listen", listen,
                 "ADDRESS:PORT, one of them or both, where browsers find the page; port 0 is any that is free")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app.add_flag("--insecure", insecure,
               "listen beyond this machine's loopback: whoever reaches the address sees everything and, without "
               "--read-only, sets the zero; nothing is encrypted");
  app.add_option("--name", server.names, "of this host, by which browsers may call it; may be given again")
      ->type_name("HOST");
  app.add_flag("--read-only", server.readOnly, "browsers may ask for no zero, and record nothing");
  app.add_option("--recordings", server.recordings,
                 "directory whose recordings browsers may play, and where those go that they make")
      ->type_name("DIRECTORY")
      ->check(CLI::ExistingDirectory);
  cli::rememberOutputErrors();  // a recording that may not grow has ended, and no more
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& stop) {
    if (stop.get_exit_code() == 0) return app.exit(stop);  // help, version
    return fail(EX_USAGE, std::string(stop.what()) + "; see traction-view --help");
  }
  if (!parseListen(listen, server)) return fail(EX_USAGE, "'" + listen + "' is not ADDRESS:PORT");
  if (!view::isLoopback(server.address) && !insecure) {
    return fail(EX_USAGE, "'" + server.address +
                              "' can be reached from other hosts, without keys and encryption; "
                              "--insecure says that this is meant (an SSH tunnel to the loopback needs it not)");
  }
  if (controls.size() > streams.size()) return fail(EX_USAGE, "--control without its --connect");

  Keys keys;
  if (!keyFile.empty() || !serverKey.empty()) keys = cli::keysFor(serverKey, keyFile);
  std::vector<view::SourceOptions> sources;
  if (instances.empty() && streams.empty()) instances.emplace_back(kDefaultInstance);
  for (const std::string& name : instances) {
    if (!isValidName(name))
      return fail(EX_USAGE, "'" + name + "' is not an instance's name: 1 to 24 of A-Z a-z 0-9 _ -");
    view::SourceOptions source{.name = name, .subscription = {}, .control = ControlOptions()};
    source.subscription.instance = source.control->instance = name;
    sources.push_back(source);
  }
  for (std::size_t i = 0; i < streams.size(); ++i) {
    if (streams[i].find("://") == std::string::npos) {
      return fail(EX_USAGE, "'" + streams[i] + "' is no endpoint: tcp://HOST:PORT or ipc:///PATH");
    }
    view::SourceOptions source{.name = streams[i], .subscription = {}, .control = std::nullopt};
    source.subscription.endpoint = streams[i];
    source.subscription.mode = latest ? Mode::kLatest : Mode::kStream;
    source.subscription.keys = keys;
    if (i < controls.size()) {
      source.control.emplace();
      source.control->endpoint = controls[i];
      source.control->keys = keys;
    }
    sources.push_back(source);
  }
  view::serve(server, sources, [](const std::string& url) { std::cout << "traction-view: " << url << std::endl; });
  return EX_OK;
} catch (const view::ServerError& error) {
  return fail(error.exitCode(), error.what());
} catch (const cli::KeyError& error) {
  return fail(error.exitCode(), error.what());
} catch (const Error& error) {
  return fail(error.code() == ErrorCode::kBadKeys ? EX_CONFIG : EX_USAGE, error.what());
} catch (const std::exception& error) {
  return fail(EX_SOFTWARE, error.what());
}
