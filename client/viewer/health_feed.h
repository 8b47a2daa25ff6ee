// Tells browsers what is wrong with a sensor, as tractionctl top does.
#pragma once

#include "client/show/scene.h"
#include "client/viewer/frame.h"

#include <cstdint>
#include <string>

namespace traction::view {

/// Derives the health of a sensor from its newest messages. Thread-bound.
class HealthFeed {
 public:
  /// \param deliver called by turn(), on its thread
  explicit HealthFeed(Deliver deliver)
      : deliver_(std::move(deliver)) {}

  /// Adds a message of the sensor to the state from which its health is judged. Ignores markers and previews.
  void take(const Message& message);

  /// Delivers kHealth at the first call, and then if something has changed, at most four times a second. Must be called
  /// some times a second, as time alone can change it.
  /// \param isConnected  to the publisher
  /// \param now_ns       CLOCK_MONOTONIC
  void turn(bool isConnected, std::int64_t now_ns);

 private:
  Deliver deliver_;
  client::Scene scene_;
  std::string sent_;
  std::int64_t toldAt_ns_ = 0;
};

}  // namespace traction::view
