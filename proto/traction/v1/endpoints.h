// Where an instance of tractiond is found: the same for the daemon and its clients.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace traction {

inline constexpr const char* kDefaultInstance = "default";

/// A subscription travels in one small frame: a longer name would not fit the 64 bytes that the publisher accepts.
inline constexpr std::size_t kMaxNameLength = 24;

/// Of a sensor or an instance: 1 to 24 of A-Z a-z 0-9 _ -.
inline bool isValidName(std::string_view name) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-";
  return !name.empty() && name.size() <= kMaxNameLength && name.find_first_not_of(kAllowed) == std::string_view::npos;
}

/// Of all topics of this version of the protocol.
inline constexpr std::string_view kTopicRoot = "traction/v1/";

/// `kind` is field, markers, description, status or preview. The slash at the end keeps every topic from being
/// another's prefix.
inline std::string topicOf(std::string_view sensor, std::string_view kind) {
  return std::string(kTopicRoot) + std::string(sensor) + "/" + std::string(kind) + "/";
}

/// ZeroMQ endpoints.
struct Endpoints {
  std::string stream;   ///< XPUB: every message, [topic][protobuf][seconds since the epoch as text]
  std::string latest;   ///< PUB: the newest field alone, single part, conflated
  std::string control;  ///< ROUTER: status, description, zero
};

/// TCP, loopback only: of the instance "default" alone; the others are told apart by their directories. No control: any
/// user of the machine reaches a port, and only the socket file's group may change what is measured.
/// 9872 is where PlotJuggler looks first.
inline constexpr int kStreamPort = 9872;
inline constexpr int kLatestPort = 9873;

inline Endpoints tcpEndpoints() {
  const std::string host = "tcp://127.0.0.1:";
  return {host + std::to_string(kStreamPort), host + std::to_string(kLatestPort), ""};
}

/// Where a traction-gateway has its stream; latest and control are behind it.
inline constexpr int kGatewayPort = 9882;

/// In an instance's runtime directory.
inline Endpoints ipcEndpoints(const std::filesystem::path& runtimeDirectory) {
  const std::string ipc = "ipc://" + runtimeDirectory.string();
  return {ipc + "/stream", ipc + "/latest", ipc + "/control"};
}

/// Where an instance's runtime directory may be, best first: the user's own (without a login session in /tmp), the
/// system's. A client takes the first that exists; a daemon started by hand the first, one started by root the last.
inline std::vector<std::filesystem::path> runtimeDirectories(const std::string& instance) {
  const char* ofUser = std::getenv("XDG_RUNTIME_DIR");
  const auto own = ofUser != nullptr && *ofUser == '/'
                       ? std::filesystem::path(ofUser) / "tractiond"
                       : std::filesystem::path("/tmp") / ("tractiond-" + std::to_string(getuid()));
  return {own / instance, std::filesystem::path("/run/tractiond") / instance};
}

}  // namespace traction
