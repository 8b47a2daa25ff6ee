// Which GigE Vision cameras answer on the networks of this host. Aravis asks too, but takes a second for it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>

namespace tractiond::capture {

/// Asks by discovery packets of the control protocol (GVCP): a camera answers them whoever controls it. Thread-bound.
class GvcpSearch {
 public:
  /// \param port of the cameras: the protocol's, but in tests
  explicit GvcpSearch(std::uint16_t port = 3956);
  ~GvcpSearch();
  GvcpSearch(const GvcpSearch&) = delete;
  GvcpSearch& operator=(const GvcpSearch&) = delete;

  /// A camera's hardware address and serial number: no other has both.
  using Identity = std::string;

  /// That of the camera at this IPv4 address; empty: nobody answers there in time. Asks once more in half of the time.
  Identity ask(const std::string& address, std::chrono::milliseconds timeout);

  /// The address at which the camera answers: the one it had, asked again and again, or another on this host's
  /// networks, asked once. Empty: none in time, or stop was asked.
  std::string locate(const Identity& camera, const std::string& lastAddress, std::chrono::milliseconds timeout,
                     const std::stop_token& stop);

  /// False where there was no descriptor left: then nobody seems to answer.
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
