// Sends contacts and grasps to subscribers.
#pragma once

#include "base/error.h"
#include "traction/v1/contacts.pb.h"
#include "traction/v1/grasp.pb.h"

#include <tl/expected.hpp>

#include <memory>
#include <string>
#include <vector>

namespace traction::contacts {

/// Thread-bound.
class Publisher {
 public:
  /// Binds to the ZeroMQ endpoints, with the errors of tractiond::network::bind(). EX_OSERR: ZeroMQ cannot start.
  static tl::expected<std::unique_ptr<Publisher>, tractiond::Error> open(const std::vector<std::string>& endpoints);
  /// Sends what waits within 0.1 s, closes the socket and removes its file.
  ~Publisher();

  /// Sends a message on the topic of the sensor, or the hand, in its header. Does not wait: a slow subscriber loses it.
  void send(const v1::Contacts& contacts);
  void send(const v1::Grasp& grasp);

  /// Returns the endpoints as they were bound.
  const std::vector<std::string>& endpoints() const;

 private:
  struct Impl;
  explicit Publisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace traction::contacts
