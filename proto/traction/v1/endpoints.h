// Where an instance of tractiond is met: names, topics, sockets. Shared by the daemon and its clients.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

namespace traction::v1 {

inline constexpr std::string_view kDefaultInstance = "default";

/// A subscription travels in one small frame; longer names would not fit the publisher's limit of 64 bytes.
inline constexpr std::size_t kMaxNameLength = 24;

/// Of a sensor or an instance: 1 to 24 of A-Z a-z 0-9 _ -.
inline bool isValidName(std::string_view name) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  return !name.empty() && name.size() <= kMaxNameLength && name.find_first_not_of(kAllowed) == std::string_view::npos;
}

/// "traction/v1/<sensor>/<kind>/", kind one of field, markers, description, status. The slash at the end keeps every
/// topic from being another's prefix.
inline std::string topic(std::string_view sensor, std::string_view kind) {
  return "traction/v1/" + std::string(sensor) + "/" + std::string(kind) + "/";
}

/// ZeroMQ addresses.
struct Endpoints {
  std::string stream;   ///< every message, [topic][protobuf][seconds since the epoch as text]
  std::string latest;   ///< the newest field alone, one part
  std::string control;  ///< requests and replies
};

/// The sockets in an instance's runtime directory.
inline Endpoints ipcEndpoints(const std::string& runtimeDirectory) {
  const std::string base = "ipc://" + runtimeDirectory + "/";
  return {base + "stream", base + "latest", base + "control"};
}

/// The default instance is also met on the loopback; 9872 is where PlotJuggler looks first.
inline Endpoints tcpEndpoints() {
  return {"tcp://127.0.0.1:9872", "tcp://127.0.0.1:9873", "tcp://127.0.0.1:9874"};
}

/// Of an instance that runs as a system service (or as root).
inline std::string systemRuntimeDirectory(std::string_view instance) {
  return "/run/tractiond/" + std::string(instance);
}

/// Of an instance that a user started by hand.
inline std::string userRuntimeDirectory(std::string_view instance) {
  const char* xdg = std::getenv("XDG_RUNTIME_DIR");
  const std::string base = xdg != nullptr && *xdg == '/' ? std::string(xdg) + "/tractiond/"
                                                         : "/tmp/tractiond-" + std::to_string(getuid()) + "/";
  return base + std::string(instance);
}

/// What the daemon uses when nothing else is said: systemd's $RUNTIME_DIRECTORY, else the system's for root and the
/// user's own for all others.
inline std::string defaultRuntimeDirectory(std::string_view instance) {
  if (const char* given = std::getenv("RUNTIME_DIRECTORY"); given != nullptr && *given == '/') return given;
  return getuid() == 0 ? systemRuntimeDirectory(instance) : userRuntimeDirectory(instance);
}

/// Where a client looks, in this order: a user's own instance hides the system's of the same name.
inline std::vector<std::string> candidateRuntimeDirectories(std::string_view instance) {
  return {userRuntimeDirectory(instance), systemRuntimeDirectory(instance)};
}

}  // namespace traction::v1
