// Asks GigE Vision cameras on the networks of this host by packets of the control protocol (GVCP). Aravis can do that
// as well, but takes a second.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>

namespace tractiond::capture {

/// Sends discovery packets, which a camera answers whichever client controls it. Thread-bound.
class GvcpSearch {
 public:
  /// Opens a socket; if that fails, usable() is false. \param port of the cameras; another than the protocol's in tests
  explicit GvcpSearch(std::uint16_t port = 3956);
  ~GvcpSearch();
  GvcpSearch(const GvcpSearch&) = delete;
  GvcpSearch& operator=(const GvcpSearch&) = delete;

  /// A camera's hardware address (6 bytes) and serial number (16 bytes), as sent: together they are unique. Not a text.
  using Identity = std::string;

  /// Asks the camera at an IPv4 address ("192.168.1.20"), waits for its answer, and returns its identity; empty if it
  /// does not answer within `timeout`. Asks again at half the time.
  Identity ask(const std::string& address, std::chrono::milliseconds timeout);

  /// Waits until the camera of this identity answers, and returns its IPv4 address, which may be new. Asks every 50 ms
  /// at its last address, and once, by broadcast, on all of this host's networks. Returns an empty text after the
  /// timeout, or within 50 ms when a stop is requested.
  std::string locate(const Identity& camera, const std::string& lastAddress, std::chrono::milliseconds timeout,
                     const std::stop_token& stop);

  /// Returns whether there is a socket; without one, no camera is found.
  bool usable() const { return socket_ >= 0; }

 private:
  struct Answer {
    std::string address;
    Identity camera;
  };
  void listenTo(const std::string& address);
  void send(const std::string& address);
  void sendToAll();  ///< to the broadcast address of each IPv4 network, not to loopback; ignores errors
  std::optional<Answer> receive(std::int64_t until_ns);

  std::uint16_t port_;
  int socket_;
  std::uint16_t request_ = 0;
};

}  // namespace tractiond::capture
