// The sockets that peers on the network reach, and who is let in.
#pragma once

#include "gateway/config.h"
#include "gateway/handshake.h"
#include "gateway/keys.h"
#include "gateway/peers.h"

#include <tl/expected.hpp>
#include <zmq.hpp>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tractiond::gateway {

enum Way : std::size_t { kStream, kLatest, kControl, kPreview, kWays };

using Endpoints = std::array<std::vector<std::string>, kWays>;

/// Thread-bound. Its end ends every connection and gives the ports back.
class Front {
 public:
  struct Options {
    Endpoints endpoints;            ///< tcp; of previews there may be none
    std::optional<KeyPair> server;  ///< empty: nobody is asked for a key
    int highWaterMark = 8;
    Limits limits;
  };

  /// Told whom was not let in, and why: for people.
  using Refused = std::function<void(const std::string& what)>;

  static tl::expected<std::unique_ptr<Front>, Error> open(const Options& options, MayEnter mayEnter, Refused refused);
  ~Front();
  Front(const Front&) = delete;
  Front& operator=(const Front&) = delete;

  zmq::socket_t& operator[](Way way) { return sockets_[way]; }
  const std::vector<std::string>& bound(Way way) const { return bound_[way]; }

  /// What to poll besides the four.
  std::vector<zmq_pollitem_t> others();
  /// Answers who asks to come in, and counts who came and went. Does not wait.
  void serve();

  Peers& peers() { return peers_; }

 private:
  Front(const Options& options, MayEnter mayEnter, Refused refused);
  void takeEvents(Way way);

  MayEnter mayEnter_;
  Refused refused_;
  Peers peers_;
  zmq::context_t context_{1};
  zmq::socket_t handshakes_{context_, zmq::socket_type::rep};  ///< ZAP, RFC 27
  std::array<zmq::socket_t, kWays> sockets_, monitors_;
  Endpoints bound_;
};

}  // namespace tractiond::gateway
