// Relays between one instrument, a tractiond on this host with the traction-touch beside it, and peers on the network:
// published messages outwards, requests inwards.
#pragma once

#include "base/clock.h"
#include "gateway/front.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::gateway {

/// One gateway: its connection to the instrument, and its front. Thread-bound except where noted. The instrument may
/// start later, and restart.
class Relay {
 public:
  using Clock = std::int64_t (*)();

  /// Connects to the instrument, for which it waits up to 300 ms, and opens the network side; an instrument that is not
  /// there is no error. Logs which keys are allowed. Errors: EX_CONFIG if other hosts could connect without a key and
  /// Config::insecure is false, or an endpoint or the gateway's key is not valid; EX_OSERR if ZeroMQ cannot start;
  /// EX_UNAVAILABLE if an address is in use or not of this machine; EX_NOPERM if there is no permission for it, or
  /// others can read the gateway's key; EX_NOINPUT if that cannot be read.
  /// \param config need not outlive the call
  /// \param instrument runtime directory of the instrument, with its sockets
  /// \param monotonicClock returns CLOCK_MONOTONIC [ns]
  static tl::expected<std::unique_ptr<Relay>, Error> open(const Config& config, const std::filesystem::path& instrument,
                                                          Clock monotonicClock = monotonicNow);
  /// Closes all connections.
  ~Relay();

  /// Waits at most `timeout` for messages, or 10 ms, whatever `timeout` is, if a description is due to a new
  /// subscriber; relays a limited number of those that have arrived, the rest in the next call. Reads the keys again
  /// every 250 ms, and at each handshake. If a key was revoked, renamed or has lost a permission, closes all
  /// connections and opens the endpoints again, for which it tries for about a second; if that fails, returns an error
  /// of open(); then neither turn() nor bound() may be called again.
  /// \param timeout negative: no limit
  tl::expected<void, Error> turn(std::chrono::milliseconds timeout);

  /// Returns the endpoints of one socket, with the port numbers in use. Valid until the next turn().
  const std::vector<std::string>& bound(Way way) const;
  /// Returns whether nothing has come from the instrument for three seconds. Thread-safe.
  bool isSilent() const;

 private:
  struct Impl;
  explicit Relay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::gateway
