#include "base/network/socket_file.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <string_view>

namespace tractiond::network {
namespace {

constexpr std::string_view kInUse = " is in use by another program";
constexpr std::string_view kIpc = "ipc://", kNoFile = "ipc://@", kTcp = "tcp://";

/// Returns why a port cannot be bound: ZeroMQ would take it modulo 65536.
std::optional<Error> checkPort(const std::string& endpoint) {
  const std::string port = endpoint.substr(endpoint.rfind(':') + 1);
  unsigned number = 0;
  const auto [end, failed] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (port == "*" || (failed == std::errc() && *end == '\0' && number <= 65535)) return std::nullopt;
  return Error{EX_CONFIG, "the port of " + endpoint + " is not a number from 0 to 65535", "", ""};
}

/// Connects to a socket file, and ends the connection. Does not wait. Returns the error; 0: there is none.
int connectionError(const sockaddr_un& address) {
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (probe < 0) return errno;
  const bool isConnected = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  const int error = isConnected ? 0 : errno;
  close(probe);
  return error;
}

}  // namespace

std::string socketFileOf(const std::string& endpoint) {
  return endpoint.starts_with(kIpc) && !endpoint.starts_with(kNoFile) ? endpoint.substr(kIpc.size()) : "";
}

std::optional<Error> checkEndpoint(const std::string& endpoint) {
  namespace fs = std::filesystem;
  if (endpoint.starts_with(kTcp)) return checkPort(endpoint);
  if (!endpoint.starts_with(kIpc) || endpoint.starts_with(kNoFile)) return std::nullopt;
  const fs::path path = socketFileOf(endpoint);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path.string();
  if (name.size() >= sizeof address.sun_path) {
    return Error{EX_CONFIG,
                 "the path of " + endpoint + " is longer than " + std::to_string(sizeof address.sun_path - 1) +
                     " characters",
                 "", "choose a shorter runtime directory"};
  }
  std::error_code ignored;
  const fs::file_status found = fs::symlink_status(path, ignored);
  if (!fs::exists(found)) {
    const fs::path directory = path.has_parent_path() ? path.parent_path() : ".";
    if (fs::is_directory(directory, ignored)) return std::nullopt;
    return Error{EX_CANTCREAT, "cannot publish at " + endpoint + ": " + directory.string() + " is not a directory", "",
                 "create it"};
  }
  if (!fs::is_socket(found)) {
    return Error{EX_CANTCREAT, "cannot publish at " + endpoint + ": " + name + " is there and is not a socket", "",
                 "remove it or choose another endpoint"};
  }
  std::ranges::copy(name, address.sun_path);
  switch (const int error = connectionError(address)) {
  case ECONNREFUSED:  // no process listens
  case ENOENT:
    return std::nullopt;
  case 0:
  case EAGAIN:  // the process does not accept connections fast enough
    return inUse(endpoint);
  default:
    return Error{EX_CANTCREAT,
                 "cannot publish at " + endpoint + ": whether a program listens at " + name +
                     " cannot be found out: " + std::strerror(error),
                 "", "remove it or choose another endpoint"};
  }
}

Error inUse(const std::string& endpoint) {
  return {EX_UNAVAILABLE, endpoint + std::string(kInUse), "",
          "end that one (ss -lntxp names it), or choose another endpoint"};
}

bool isInUse(const Error& error) {
  return error.what.ends_with(kInUse);
}

}  // namespace tractiond::network
