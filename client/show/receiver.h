// Collects the data of a live view. One thread only receives, so that drawing does not make messages appear late.
#pragma once

#include "client/show/scene.h"

#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <thread>

namespace traction::client {

using Clock = std::chrono::steady_clock;  ///< CLOCK_MONOTONIC, as the messages' times

/// Returns a time as nanoseconds of CLOCK_MONOTONIC.
std::int64_t nanoseconds(Clock::time_point time);

/// Receives messages on a thread of its own during its lifetime, and collects them in a scene.
class Receiver {
 public:
  /// Starts the thread. Does not wait for a publisher.
  /// \throws Error kBadEndpoint, kBadKeys
  explicit Receiver(const SubscriberOptions& options);
  /// Waits for the thread, some 50 ms at most.
  ~Receiver();

  /// Returns a copy of the current scene. Does not wait for messages. Thread-safe. If receiving has thrown an Error,
  /// nothing more is received, and each call rethrows it.
  Scene scene();

  /// Returns the endpoint that is subscribed to, for messages. Valid as long as the object. Thread-safe.
  const std::string& endpoint() const { return subscriber_.endpoint(); }

 private:
  void run();

  Subscriber subscriber_;
  std::mutex mutex_;  ///< guards scene_ and failure_
  Scene scene_;
  std::exception_ptr failure_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace traction::client
