// What is known of an instance at one moment, gathered from its messages.
#pragma once

#include "traction/subscriber.h"

#include <deque>

namespace traction::cli {

/// Thread-compatible; time comes in from outside.
class Scene {
 public:
  void add(Message message);

  std::optional<Field> field;
  std::optional<Description> description;
  std::optional<Status> status;
  std::uint64_t fields = 0;  ///< received
  std::uint64_t lost = 0;    ///< on the way, as the subscriber says
  std::int64_t lastArrival_ns = 0;
  bool connected = false;  ///< somebody publishes, perhaps without having anything to say yet

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
  };
  std::deque<Arrival> arrivals_;
  std::deque<double> history_;
  std::int64_t sampled_ns_ = 0;
};

double length(const Vector3& vector);

}  // namespace traction::cli
