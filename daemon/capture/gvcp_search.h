// Finds the GigE Vision cameras on the networks of this host. Aravis can do so, too, but takes a second.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>

namespace tractiond::capture {

/// Sends discovery packets of the control protocol (GVCP), which a camera answers even if another client controls it.
/// Thread-bound.
class GvcpSearch {
 public:
  /// \param port of the cameras; tests use another one than the protocol's
  explicit GvcpSearch(std::uint16_t port = 3956);
  ~GvcpSearch();
  GvcpSearch(const GvcpSearch&) = delete;
  GvcpSearch& operator=(const GvcpSearch&) = delete;

  /// A camera's hardware address and serial number, which identify it.
  using Identity = std::string;

  /// Returns the identity of the camera at this IPv4 address; empty: no answer in time. Asks again after half of the
  /// time.
  Identity ask(const std::string& address, std::chrono::milliseconds timeout);

  /// Returns the address at which the camera answers. Asks its last address again and again, and all of this host's
  /// networks once. Empty: no answer in time, or a stop was requested.
  std::string locate(const Identity& camera, const std::string& lastAddress, std::chrono::milliseconds timeout,
                     const std::stop_token& stop);

  /// Returns false if no socket could be opened: then no camera seems to answer.
  bool usable() const { return socket_ >= 0; }

 private:
  struct Answer {
    std::string address;
    Identity camera;
  };
  void listenTo(const std::string& address);
  void send(const std::string& address);
  void sendToAll();
  std::optional<Answer> receive(std::int64_t until_ns);

  std::uint16_t port_;
  int socket_;
  std::uint16_t request_ = 0;
};

}  // namespace tractiond::capture
