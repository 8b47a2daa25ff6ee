#include "daemon/app/instance.h"

#include "proto/traction/v1/endpoints.h"

#include <unistd.h>

#include <system_error>
#include <utility>

namespace tractiond {
namespace {

namespace fs = std::filesystem;

fs::path stateDirectory(const std::string& instance) {
  if (auto given = fromEnvironment("STATE_DIRECTORY"); !given.empty()) return given;
  if (geteuid() == 0) return fs::path("/var/lib/tractiond") / instance;
  auto base = fromEnvironment("XDG_STATE_HOME");
  if (base.empty()) base = fromEnvironment("HOME") / ".local/state";
  return base / "tractiond" / instance;
}

}  // namespace

tl::expected<Places, Error> located(Places places) {
  if (!traction::isValidName(places.instance)) {
    return tl::unexpected(Error{.exitCode = EX_USAGE,
                                .what = "--instance \"" + places.instance + "\" is not a name",
                                .remedy = "1 to 24 of A-Z, a-z, 0-9, _ and - are"});
  }
  if (places.config.empty()) {
    const auto standard = fs::path("/etc/tractiond") / (places.instance + ".toml");
    std::error_code absent;
    if (fs::exists(standard, absent)) places.config = standard;
  }
  if (places.state.empty()) places.state = stateDirectory(places.instance);
  if (places.runtime.empty()) places.runtime = runtimeDirectory(places.instance, traction::kDaemon);
  // Relative paths do not suit ZeroMQ's addresses and a service's working directory.
  places.state = fs::absolute(places.state);
  places.runtime = fs::absolute(places.runtime);
  return places;
}

Config completed(Config config, const Places& places) {
  const traction::Endpoints ipc = traction::ipcEndpoints(places.runtime), tcp = traction::tcpEndpoints();
  const bool alsoTcp = places.instance == traction::kDefaultInstance;
  const auto complete = [&](std::vector<std::string>& endpoints, std::string traction::Endpoints::*one) {
    if (!endpoints.empty()) return;
    endpoints.push_back(ipc.*one);
    if (alsoTcp && !(tcp.*one).empty()) endpoints.push_back(tcp.*one);
  };
  complete(config.publish.stream, &traction::Endpoints::stream);
  complete(config.publish.latest, &traction::Endpoints::latest);
  complete(config.controlEndpoints, &traction::Endpoints::control);
  if (config.sensor.name.empty()) config.sensor.name = places.instance;
  if (config.sensor.gelFile == kAdoptedGelFile) {
    config.sensor.adopted = places.state / "adopted.toml";
    std::error_code absent;
    config.sensor.gelFile = fs::exists(config.sensor.adopted, absent) ? config.sensor.adopted : std::string(kNoGelFile);
  }
  return config;
}

}  // namespace tractiond
