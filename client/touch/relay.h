// Fields in, contacts out: the loop of the programs that follow the contacts of one sensor.
#pragma once

#include "base/clock.h"
#include "base/service/service.h"
#include "client/touch/follower.h"
#include "traction/subscriber.h"
#include "traction/v1/contacts.pb.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdint>
#include <string>

namespace traction::contacts {

/// Returns a new id, as of a run.
Id randomId();

/// Takes what a Relay makes of fields.
class RelayOutput {
 public:
  virtual ~RelayOutput() = default;

  /// \param follower of these contacts
  /// \param contacts the same as a message
  /// \param field that they are of; null: none came in time, or all end here, as the sensor is another or the program
  /// stops
  virtual void take(const Follower& follower, const v1::Contacts& contacts, const Field* field) = 0;
  /// Is called at least ten times a second, whether or not fields come.
  virtual void turn() {}
};

/// What one turn of the program's only loop does. Thread-bound.
class Relay {
 public:
  /// \param output must outlive this
  Relay(const SubscriberOptions& options, RelayOutput& output)
      : subscriber_(options)
      , output_(output)
      , follower_({.run = randomId()}) {}

  /// Waits for a field, at most until it is late where there are contacts, and passes its contacts on.
  void turn();
  /// Passes the ends of all contacts on.
  void endAll();
  /// Returns the line for `systemctl status`.
  std::string statusLine() const;

 private:
  static std::int64_t now() { return tractiond::monotonicNow(); }
  std::int64_t silentAt() const {
    return std::max(follower_.arrived_ns(), waited_ns_) + follower_.silence_ns() + 1'000'000;
  }

  void pass(const Field& field);
  bool isTimeToTell();
  /// Logs what has changed.
  void tell();

  Subscriber subscriber_;
  RelayOutput& output_;
  Follower follower_;
  std::string sensor_;  ///< of the last field
  std::string second_;  ///< as Subscriber::secondSource(), in the log
  bool isSilent_ = false;
  std::uint64_t lost_ = 0;  ///< lost fields that are in the log
  std::int64_t started_ns_ = now(), reported_ns_ = 0;
  std::int64_t waited_ns_ = 0;  ///< when contacts were last told without a field
};

inline constexpr std::int64_t kTurn_ns = 100'000'000;  ///< longest time between two turns of the service

/// Runs a relay, of one sensor or of a hand, until a signal comes. Requires tractiond::catchSignals().
void runRelay(auto& relay) {
  const tractiond::ServiceHooks hooks{
      .loops = {}, .ended = [] { return false; }, .statusLine = [&] { return relay.statusLine(); }};
  tractiond::ServiceLoop loop(hooks);
  tractiond::admitSignals();
  for (std::int64_t turned_ns = 0;;) {
    relay.turn();
    const std::int64_t now_ns = tractiond::monotonicNow();
    if (now_ns - turned_ns < kTurn_ns / 2) continue;
    turned_ns = now_ns;
    if (!loop.turn()) break;
  }
  relay.endAll();
  spdlog::info("stopped");
}

}  // namespace traction::contacts
