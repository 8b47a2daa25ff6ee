// The ZeroMQ socket of a replay.
#pragma once

#include "traction/subscriber.h"

#include <memory>
#include <string>

namespace traction::client {

/// Publishes recorded messages as tractiond publishes its stream. Thread-bound.
class Repeater {
 public:
  /// Binds the ZeroMQ endpoint, "tcp://ADDRESS:PORT" or "ipc:///PATH"; port * or 0 takes a free one. Replaces a socket
  /// file on which no process listens. \throws Error kBadEndpoint, also if it is in use, its port is no number from 0
  /// to 65535, or its path is that of another file
  explicit Repeater(const std::string& endpoint);
  /// Waits up to a second for slow readers.
  ~Repeater();

  /// Returns the endpoint, with the port in use.
  std::string endpoint() const;
  /// Waits up to `time` until subscriptions begin or end, or a signal comes. For each one that has begun, publishes the
  /// last description of each sensor again, which all subscribers of descriptions receive. \param time 0 or more
  void listen(std::chrono::milliseconds time);
  /// Returns whether listen() has ever received a subscription.
  bool isHeard() const;
  /// Sends a message, and keeps a copy if it is a description, for listen(). Does not wait: a client that is too slow
  /// loses it. \param raw is copied \param time_s publish time of the recording, which goes with the message [s since
  /// 1970]
  void send(const Raw& raw, double time_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace traction::client
