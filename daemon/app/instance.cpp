#include "daemon/app/instance.h"

#include "base/directory.h"
#include "proto/traction/v1/endpoints.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

namespace tractiond {
namespace {

namespace fs = std::filesystem;

/// Returns an absolute path from the environment; empty if there is none.
fs::path fromEnvironment(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value == '/' ? value : "";
}

fs::path stateDirectory(const std::string& instance) {
  if (auto given = fromEnvironment("STATE_DIRECTORY"); !given.empty()) return given;
  if (geteuid() == 0) return fs::path("/var/lib/tractiond") / instance;
  auto base = fromEnvironment("XDG_STATE_HOME");
  if (base.empty()) base = fromEnvironment("HOME") / ".local/state";
  return base / "tractiond" / instance;
}

fs::path runtimeDirectory(const std::string& instance) {
  if (auto given = fromEnvironment("RUNTIME_DIRECTORY"); !given.empty()) return given;
  const auto candidates = traction::runtimeDirectories(instance);
  return geteuid() == 0 ? candidates.back() : candidates.front();
}

tl::unexpected<Error> unusable(const std::string& what, const fs::path& path, int exitCode, const std::string& why) {
  return tl::unexpected(Error{.exitCode = exitCode,
                              .what = "the " + what + " " + path.string() + " cannot be used: " + why,
                              .remedy = "choose another with --" + what.substr(0, what.find(' '))});
}

tl::unexpected<Error> unusable(const std::string& what, const fs::path& path, int error) {
  const bool denied = error == EACCES || error == EPERM || error == EROFS;
  return unusable(what, path, denied ? EX_NOPERM : EX_CANTCREAT, std::generic_category().message(error));
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
  if (places.runtime.empty()) places.runtime = runtimeDirectory(places.instance);
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
  return config;
}

std::vector<fs::path> socketFiles(const Config& completed) {
  constexpr std::string_view kIpc = "ipc://";
  std::vector<fs::path> files;
  for (const auto* list : {&completed.publish.stream, &completed.publish.latest, &completed.controlEndpoints}) {
    for (const std::string_view endpoint : *list) {
      if (endpoint.starts_with(kIpc) && !endpoint.starts_with("ipc://@"))
        files.emplace_back(endpoint.substr(kIpc.size()));
    }
  }
  return files;
}

tl::expected<OwnDirectory, Error> OwnDirectory::claim(const fs::path& path, const std::string& what) {
  std::error_code failure;
  const bool made = fs::create_directories(path, failure);
  if (failure) return unusable(what, path, failure.value());
  const int descriptor = open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return unusable(what, path, errno);
  OwnDirectory directory(path, descriptor, made);
  struct stat own {};
  if (fstat(descriptor, &own) != 0 || canOthersControl(path, own)) {
    return unusable(what, path, EX_NOPERM,
                    "another user may control it, as every user can write into it or a directory above");
  }
  if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return unusable(what, path, errno);
    return tl::unexpected(Error{.exitCode = EX_TEMPFAIL,
                                .what = "the " + what + " " + path.string() + " is in use by another tractiond",
                                .remedy = "stop that one, or give this one a name with --instance"});
  }
  if (access(path.c_str(), W_OK) != 0) return unusable(what, path, errno);
  return directory;
}

OwnDirectory::OwnDirectory(fs::path path, int descriptor, bool made)
    : path_(std::move(path))
    , descriptor_(descriptor)
    , made_(made) {}

OwnDirectory::OwnDirectory(OwnDirectory&& other) noexcept
    : path_(std::move(other.path_))
    , descriptor_(std::exchange(other.descriptor_, -1))
    , made_(other.made_) {}

OwnDirectory::~OwnDirectory() {
  if (descriptor_ < 0) return;
  if (made_) rmdir(path_.c_str());  // fails if the directory is not empty
  close(descriptor_);
}

}  // namespace tractiond
