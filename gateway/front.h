// The sockets that peers on the network connect to, and their access control.
#pragma once

#include "base/network/keys.h"
#include "gateway/config.h"
#include "gateway/handshake.h"

#include <tl/expected.hpp>
#include <zmq.hpp>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tractiond::gateway {

/// The sockets: stream, latest, control and preview.
enum Way : std::size_t { kStream, kLatest, kControl, kPreview, kWays };

using Endpoints = std::array<std::vector<std::string>, kWays>;

/// Owns the sockets of all ways. Thread-bound. The destructor closes every connection and releases the ports.
class Front {
 public:
  struct Options {
    Endpoints endpoints;                     ///< tcp; the previews may have none
    std::optional<network::KeyPair> server;  ///< empty: connections need no key
    /// Messages of stream queued for one slow peer; further ones are lost. Of latest the newest is kept, of previews 2,
    /// of replies 16.
    int highWaterMark = 8;
  };

  /// Called for each rejected handshake with the peer and the reason, as text for the log.
  using Refused = std::function<void(const std::string& what)>;

  /// Opens and binds all sockets. Errors: EX_OSERR if ZeroMQ cannot start; those of network::bind(): EX_CONFIG,
  /// EX_UNAVAILABLE if an address is in use or not of this machine, EX_NOPERM.
  /// \param mayEnter, refused called by serve(), on its thread, only if connections need a key
  static tl::expected<std::unique_ptr<Front>, Error> open(const Options& options, MayEnter mayEnter, Refused refused);
  ~Front();

  /// Returns the socket of a way: XPUB of stream and previews, PUB of latest, ROUTER of control. Valid as long as the
  /// front exists.
  zmq::socket_t& operator[](Way way) { return sockets_[way]; }
  /// Returns the endpoints of a way, with the port numbers in use; empty if it has none. Valid as long as the front
  /// exists.
  const std::vector<std::string>& bound(Way way) const { return bound_[way]; }

  /// Returns what the caller must poll (zmq_poll) besides the four sockets: serve() must be called when it is readable.
  /// Valid as long as the front exists.
  zmq_pollitem_t handshakes();
  /// Answers pending handshakes, at most 64 per call; what is left stays readable for the next one. Never waits.
  void serve();

 private:
  Front(const Options& options, MayEnter mayEnter, Refused refused);

  MayEnter mayEnter_;
  Refused refused_;
  zmq::context_t context_{1};
  zmq::socket_t handshakes_{context_, zmq::socket_type::rep};  ///< answers authentication requests (ZAP, RFC 27)
  std::array<zmq::socket_t, kWays> sockets_;
  Endpoints bound_;
};

}  // namespace tractiond::gateway
