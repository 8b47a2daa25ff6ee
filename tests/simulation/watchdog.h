// systemd's watchdog, fed by the daemon's liveness check, and its laws.
#pragma once

#include "base/service/service.h"
#include "daemon/records/turns.h"
#include "tests/simulation/capture_side.h"

#include <array>

namespace tractiond::simulation {

class Watchdog {
 public:
  static constexpr std::size_t kStages = 5;

  /// All outlive it.
  Watchdog(const Turns& turns, const CaptureSide& camera, Journal& journal, const Starvation& starvation);

  /// Notes that a stage has taken a turn: the world's own account.
  void heedTurn(std::size_t stage) { hasTurned_[stage] = true; }
  std::int64_t next_ns() const { return next_ns_; }
  /// Lets the service look, if that is due. Law: it feeds if and only if every stage advances and the keeper does not
  /// hang.
  void turn();
  /// Returns whether the daemon is to be killed, as it was not fed for too long. Law: something stood still.
  bool bites() const;

 private:
  const CaptureSide& camera_;
  Journal& journal_;
  const Starvation& starvation_;
  ServiceHooks hooks_;
  LivenessCheck check_;
  std::array<bool, kStages> hasTurned_{};
  std::int64_t next_ns_, fed_ns_;
};

}  // namespace tractiond::simulation
