#include "client/show/receiver.h"

namespace traction::client {

using namespace std::chrono_literals;

std::int64_t nanoseconds(Clock::time_point time) {
  return std::chrono::nanoseconds(time.time_since_epoch()).count();
}

Receiver::Receiver(const SubscriberOptions& options)
    : subscriber_(options) {
  scene_.setConnected(false, nanoseconds(Clock::now()));
  thread_ = std::thread([this] { run(); });
}

Receiver::~Receiver() {
  stop_ = true;
  thread_.join();
}

Scene Receiver::scene() {
  const std::lock_guard lock(mutex_);
  if (failure_) std::rethrow_exception(failure_);
  return scene_;
}

void Receiver::run() try {
  while (!stop_) {
    auto message = subscriber_.receive(50ms);
    const std::lock_guard lock(mutex_);
    scene_.setConnected(subscriber_.isConnected(), nanoseconds(Clock::now()));
    if (message) scene_.add(*std::move(message));
    scene_.lost = subscriber_.lost();
  }
} catch (...) {
  const std::lock_guard lock(mutex_);
  failure_ = std::current_exception();
}

}  // namespace traction::client
