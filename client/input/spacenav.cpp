#include "client/input/spacenav.h"

#include "base/network/socket_file.h"

#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>

namespace traction::input {
namespace {

constexpr std::int32_t kMotion = 0;
/// A client asks for a version of the protocol by a number that is no finite sensitivity; the last byte is the version.
constexpr std::uint32_t kVersion = 0x7faa5500, kVersionMask = 0xffffff00;

tractiond::Error failed(const std::filesystem::path& path, int exitCode) {
  return {exitCode, "no socket can be made at " + path.string() + ": " + std::strerror(errno), "",
          "name another one in the profile, as spacenav.socket"};
}

}  // namespace

std::filesystem::path spacenavSocket() {
  const char* const session = std::getenv("XDG_RUNTIME_DIR");
  return std::filesystem::path(geteuid() == 0 || session == nullptr ? "/run" : session) / "spnav.sock";
}

tl::expected<std::unique_ptr<Spacenav>, tractiond::Error> Spacenav::open(const std::filesystem::path& path,
                                                                         const AxesOptions& options) {
  if (auto fault = tractiond::network::checkEndpoint("ipc://" + path.string())) {
    fault->remedy = tractiond::network::isInUse(*fault) ? "is it spacenavd's? Stop that, or name another socket"
                                                        : "name another one in the profile, as spacenav.socket";
    return tl::unexpected(*std::move(fault));
  }
  const int descriptor = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return tl::unexpected(failed(path, EX_OSERR));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::ranges::copy(path.string(), address.sun_path);
  unlink(path.c_str());  // of a program that was killed
  // All users may connect to root's socket, as to spacenavd's; bind() makes the file, so that no other is changed.
  const mode_t mask = umask(0111);
  if (geteuid() != 0) umask(mask);
  const bool isBound = bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  umask(mask);
  if (!isBound || listen(descriptor, 8) != 0) {
    const auto error = failed(path, EX_CANTCREAT);
    close(descriptor);
    return tl::unexpected(error);
  }
  spdlog::info("listening at {}", path.string());
  return std::unique_ptr<Spacenav>(new Spacenav(descriptor, path, options));
}

Spacenav::Spacenav(int descriptor, std::filesystem::path path, const AxesOptions& options)
    : descriptor_(descriptor)
    , path_(std::move(path))
    , options_(options) {}

Spacenav::~Spacenav() {
  for (const Client& client : clients_) close(client.descriptor);
  unlink(path_.c_str());
  close(descriptor_);
}

void Spacenav::write(const Touches& touches) {
  const auto axes = axesOf(touches.wrench, options_);
  // From (right, away, up) to the axes of a 3-D mouse, which are left-handed: right, up, away.
  axes_ = {axes[0], axes[2], axes[1], -axes[3], -axes[5], -axes[4]};
  period_ms_ = static_cast<std::int32_t>(std::clamp<std::int64_t>((touches.time_ns - time_ns_) / 1'000'000, 1, 1000));
  time_ns_ = touches.time_ns;
  std::erase_if(clients_, [&](Client& client) {
    const bool gone = axes_ != Axes{} && !tell(client);
    if (gone) close(client.descriptor);
    return gone;
  });
}

void Spacenav::turn(std::int64_t) {
  for (int client; (client = accept4(descriptor_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC)) >= 0;)
    clients_.push_back({.descriptor = client});
  std::erase_if(clients_, [&](Client& client) {
    const bool gone = !hear(client) || (client.sent != axes_ && !tell(client));
    if (gone) close(client.descriptor);
    return gone;
  });
}

bool Spacenav::hear(Client& client) {
  client.turnsLeft = std::max(0, client.turnsLeft - 1);
  std::array<std::uint32_t, 16> words{};
  const ssize_t size = recv(client.descriptor, words.data(), sizeof words, 0);
  if (size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR)) return false;
  if (size < static_cast<ssize_t>(sizeof words[0])) return true;
  client.turnsLeft = 0;
  const std::size_t count = static_cast<std::size_t>(size) / sizeof words[0];
  for (std::size_t i = 0; i < count; ++i) {
    const auto sensitivity = std::bit_cast<float>(words[i]);
    if (std::isfinite(sensitivity)) client.sensitivity = sensitivity;
  }
  // A client that has said more since has not waited for the answer.
  if ((words[count - 1] & kVersionMask) == kVersion)
    return send(client.descriptor, &kVersion, sizeof kVersion, MSG_NOSIGNAL) == sizeof kVersion;
  return true;
}

bool Spacenav::tell(Client& client) const {
  if (client.turnsLeft > 0) return true;
  std::array<std::int32_t, 8> event = {kMotion};
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    constexpr float kMost = 1e6F;
    event[i + 1] =
        static_cast<std::int32_t>(std::clamp(client.sensitivity * static_cast<float>(axes_[i]), -kMost, kMost));
  }
  event.back() = period_ms_;
  const ssize_t size = send(client.descriptor, event.data(), sizeof event, MSG_NOSIGNAL);
  if (size == static_cast<ssize_t>(sizeof event)) client.sent = axes_;
  return size == static_cast<ssize_t>(sizeof event) || errno == EAGAIN || errno == EINTR;
}

}  // namespace traction::input
