// Where an instance of tractiond is found: the same for the daemon and its clients.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace traction {

/// ZeroMQ endpoints.
struct Endpoints {
  std::string stream;   ///< XPUB: every message, multipart
  std::string latest;   ///< PUB: the newest field alone, single part, conflated
  std::string control;  ///< REP: status, description, zero
};

inline constexpr const char* kDefaultInstance = "default";

/// TCP, loopback only: of the instance "default" alone; the others are told apart by their directories.
inline constexpr int kStreamPort = 5570;
inline constexpr int kLatestPort = 5571;
inline constexpr int kControlPort = 5572;

inline Endpoints tcpEndpoints() {
  const std::string host = "tcp://127.0.0.1:";
  return {host + std::to_string(kStreamPort), host + std::to_string(kLatestPort), host + std::to_string(kControlPort)};
}

/// In an instance's runtime directory.
inline Endpoints ipcEndpoints(const std::filesystem::path& runtimeDirectory) {
  const std::string ipc = "ipc://" + runtimeDirectory.string();
  return {ipc + "/stream", ipc + "/latest", ipc + "/control"};
}

/// Where an instance's runtime directory may be, best first: the user's own, the system's.
inline std::vector<std::filesystem::path> runtimeDirectories(const std::string& instance) {
  std::vector<std::filesystem::path> candidates;
  if (const char* ofUser = std::getenv("XDG_RUNTIME_DIR"); ofUser && *ofUser) {
    candidates.push_back(std::filesystem::path(ofUser) / "tractiond" / instance);
  }
  candidates.push_back(std::filesystem::path("/run/tractiond") / instance);
  return candidates;
}

}  // namespace traction
