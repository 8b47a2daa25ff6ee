// systemd as the daemon sees it: it hears notices, sends signals, and ends what does not feed its watchdog; and its
// laws. The daemon's side is the real loop of base/service.
#pragma once

#include "base/service/service.h"
#include "tests/simulation/capture_side.h"
#include "tests/simulation/operator.h"

#include <algorithm>
#include <array>
#include <optional>

namespace tractiond::simulation {

class Supervisor {
 public:
  static constexpr std::size_t kStages = 5;
  static constexpr std::int64_t kStopsWithin_ns = 20 * kSecond;  ///< TimeoutStopSec= of the unit

  /// Begins to supervise a daemon that has started. All references must outlive it. Only one may exist at a time;
  /// systemd::notify() reaches it.
  Supervisor(const ServiceHooks& hooks, const CaptureSide& camera, const Operator& person, Journal& journal,
             const Starvation& starvation);
  ~Supervisor();

  /// Notes that a stage has taken a turn: the world's own account.
  void noteTurn(std::size_t stage) { hasTurned_[stage] = true; }
  /// Send SIGHUP (askReload()) or SIGTERM (askStop()).
  void askReload();
  void askStop();

  /// Returns when something is due: the loop's next turn, or the end of the watchdog's patience.
  std::int64_t next_ns() const { return std::min(next_ns_, bites_ns()); }
  /// Lets the service's loop take its turn, if that is due, and returns whether it was. Laws: it waits for nothing, it
  /// feeds the watchdog if and only if every stage advances and the keeper does not hang, reloads begin and end in
  /// time.
  bool turn();
  /// Returns whether no reload is asked for, or under way.
  bool isSettled() const { return !askedReload_ns_ && !loop_.isReloading(); }
  /// Returns whether the loop has ended.
  bool hasEnded() const { return hasEnded_; }
  /// Returns whether the daemon is to be killed, as it was not fed for too long. Law: something stood still.
  bool bites() const;

  /// Hears a notice. Law: notices come in their order.
  void hear(const std::string& text);

 private:
  enum class Notified { kNothing, kReady, kReloading, kStopping };

  const ServiceHooks& attend(const ServiceHooks& hooks);
  void checkFeeding();
  void checkReload() const;
  std::int64_t bites_ns() const;

  const CaptureSide& camera_;
  const Operator& person_;
  Journal& journal_;
  const Starvation& starvation_;
  Notified notified_ = Notified::kNothing;
  bool isFed_ = false;  ///< in this turn
  std::array<bool, kStages> hasTurned_{};
  std::int64_t next_ns_, fed_ns_;
  std::optional<std::int64_t> askedReload_ns_, askedStop_ns_;  ///< not handled yet
  bool hasEnded_ = false;
  ServiceLoop loop_;
};

}  // namespace tractiond::simulation
