// Relays between one instrument and peers on the network: published messages outwards, requests inwards.
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

/// Thread-bound except where noted. The instrument may start later, and restart.
class Relay {
 public:
  using Clock = std::int64_t (*)();

  /// Connects to the instrument, for which it waits up to 300 ms, and opens the network side. Errors: EX_CONFIG if
  /// other hosts could connect without a key, EX_OSERR, and those of Front::open() and loadKeyPair().
  /// \param instrument runtime directory of the instrument
  /// \param monotonicClock returns CLOCK_MONOTONIC [ns]
  static tl::expected<std::unique_ptr<Relay>, Error> open(const Config& config, const std::filesystem::path& instrument,
                                                          Clock monotonicClock = monotonicNow);
  ~Relay();

  /// Waits at most `timeout` for messages and relays those that have arrived. Fails if the endpoints cannot be opened
  /// again after a key was revoked.
  tl::expected<void, Error> turn(std::chrono::milliseconds timeout);

  /// Returns the endpoints of one socket, with the port numbers in use.
  const std::vector<std::string>& bound(Way way) const;
  int peers() const;  ///< number of connections; callable from any thread

 private:
  struct Impl;
  explicit Relay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::gateway
