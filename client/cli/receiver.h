// What a live view knows: one thread receives, so that drawing does not make messages look late.
#pragma once

#include "client/cli/scene.h"

#include <atomic>
#include <chrono>
#include <exception>
#include <mutex>
#include <thread>

namespace traction::cli {

using Clock = std::chrono::steady_clock;  ///< CLOCK_MONOTONIC, as are the messages' times

std::int64_t nanoseconds(Clock::time_point time);

/// Receives in a thread of its own for as long as it lives.
class Receiver {
 public:
  /// \throws Error
  explicit Receiver(const SubscriberOptions& options);
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// What is known now. Thread-safe. \throws what receiving has thrown
  Scene scene();

  const std::string& endpoint() const { return subscriber_.endpoint(); }

 private:
  void run();

  Subscriber subscriber_;
  std::mutex mutex_;  ///< guards the two below
  Scene scene_;
  std::exception_ptr failure_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace traction::cli
