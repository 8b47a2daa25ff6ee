// Between one instrument and peers on the network: passes on what it publishes, and what they ask of it.
#pragma once

#include "daemon/base/clock.h"
#include "gateway/front.h"

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::gateway {

/// Thread-bound, but for what is noted as such. The instrument may start later, and again.
class Relay {
 public:
  using Clock = std::int64_t (*)();

  /// \param instrument its runtime directory \param monotonicClock returns CLOCK_MONOTONIC [ns]
  /// EX_CONFIG where other hosts would be let in without a key, and what the endpoints and the box's key may have.
  static tl::expected<std::unique_ptr<Relay>, Error> open(const Config& config, const std::filesystem::path& instrument,
                                                          Clock monotonicClock = monotonicNow);
  ~Relay();

  /// Waits for something to pass on, no longer than this, and passes on what has come. Fails where the endpoints are
  /// lost.
  tl::expected<void, Error> turn(std::chrono::milliseconds timeout);

  const std::vector<std::string>& bound(Way way) const;
  int peers() const;  ///< any thread

 private:
  struct Impl;
  explicit Relay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::gateway
