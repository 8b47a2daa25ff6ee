// ZeroMQ beside the library: what a recording is filled from besides the stream, and what it is replayed on.
#pragma once

#include "traction/subscriber.h"

#include <memory>
#include <optional>
#include <string>

namespace traction::cli {

/// Hears what traction-twin says was true (--truth-endpoint). Thread-bound.
class TruthListener {
 public:
  /// \throws Error kBadEndpoint
  explicit TruthListener(const std::string& endpoint);
  ~TruthListener();

  /// A line of JSON that waits; empty: none.
  std::optional<std::string> next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A stream as tractiond has it, of messages that were kept. Thread-bound.
class Repeater {
 public:
  /// \throws Error kBadEndpoint, also where it is in use
  explicit Repeater(const std::string& endpoint);
  /// Waits a second for slow readers.
  ~Repeater();

  /// Where it is met.
  std::string endpoint() const;
  /// Takes subscriptions for so long; who is new is sent the last description of each sensor.
  void listen(std::chrono::milliseconds time);
  /// Somebody has subscribed.
  bool isHeard() const;
  /// \param time_s when it was sent first [s since 1970]. Who is too slow loses it.
  void send(const Raw& raw, double time_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace traction::cli
