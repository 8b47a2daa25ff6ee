// What is known of an instance at one moment, gathered from its messages.
#pragma once

#include "traction/subscriber.h"

#include <deque>
#include <string>
#include <vector>

namespace traction::cli {

/// Thread-compatible; time comes in from outside: CLOCK_MONOTONIC, as in the messages' arrival.
class Scene {
 public:
  /// Of another start of the daemon than what was known: nothing of that is kept.
  void add(Message message);
  /// Whether somebody publishes, perhaps without having anything to say yet.
  void setConnected(bool isConnected, std::int64_t now_ns);

  /// Why there is no field of now; its text stays the same for as long as the reason does.
  struct Trouble {
    std::string what;      ///< "the camera is lost"; empty: there is a field, and it is of now
    double since_s = 0.0;  ///< it has lasted; of a field that has been there, its age
  };
  Trouble trouble(std::int64_t now_ns) const;
  /// trouble() in words: "the camera is lost, no field for 12.3 s".
  std::string sentence(const Trouble& trouble) const;

  std::optional<Field> field;
  std::optional<Description> description;
  std::optional<Status> status;
  std::optional<Status> statusBefore;  ///< the one before, of the same start of the daemon
  std::uint64_t fields = 0;            ///< received
  std::uint64_t lost = 0;              ///< on the way, as the subscriber says
  std::int64_t lastArrival_ns = 0;
  std::int64_t restarted_ns = 0;  ///< when a new start of the daemon was noticed; 0: never
  bool connected() const { return connected_; }

  /// The status is not of now: the next one is late, or fields that came when it was sent do no more.
  bool isStatusOld(std::int64_t now_ns) const;

  /// Or-ed Flag, of the fields of the last two seconds.
  std::uint32_t recentFlags(std::int64_t now_ns) const;

  /// Of the fields of the last two seconds [1/s].
  double rate_hz(std::int64_t now_ns) const;

  struct Latency {
    double p50_ms, p99_ms;
  };
  /// Frame popped from the camera driver -> received here, of the fields of the last two seconds. Empty: there are
  /// none, or the clocks are different ones.
  std::optional<Latency> latency(std::int64_t now_ns) const;

  /// Of the resultant [N], one every quarter second, newest last.
  const std::deque<double>& history() const { return history_; }

 private:
  struct Arrival {
    std::int64_t at_ns, latency_ns;
    std::uint32_t flags;
  };
  bool isOld(std::int64_t now_ns) const;
  std::string reason(std::int64_t now_ns) const;

  bool connected_ = false, wasConnected_ = false;
  bool heard_ = false;  ///< something, since the connection before was lost
  std::int64_t connectionChanged_ns_ = 0;
  Id boot_{};
  std::int64_t fieldArrival_ns_ = 0, statusArrival_ns_ = 0;  ///< of this boot; 0: none
  std::deque<Arrival> arrivals_;
  std::deque<double> history_;
  std::int64_t sampled_ns_ = 0;
};

double length(const Vector3& vector);

/// Or-ed Flag, most important first.
std::vector<std::string> words(std::uint32_t flags);

/// "2.3 s", "12 s", "5 min".
std::string duration(double seconds);

}  // namespace traction::cli
