// Tracks which connections subscribe to topics.
#pragma once

#include <zmq.hpp>

#include <cstddef>
#include <map>
#include <string>

namespace tractiond::network {

/// Tracks subscriptions by connection: a publisher with ZMQ_XPUB_VERBOSER receives repeated subscriptions, and
/// cancellations of what was not subscribed to, as well, so that they cannot be counted. Thread-bound.
class Subscriptions {
 public:
  /// Notes a subscription (\1TOPIC) or cancellation (\0TOPIC) that the publisher has received; ignores other messages.
  /// When a connection ends, ZeroMQ makes a cancellation of each of its topics, without a source.
  void note(zmq::message_t& message);
  /// Returns whether no connection has a subscription.
  bool empty() const { return topics_.empty(); }
  /// Returns how many subscriptions are kept, some of ended connections among them.
  std::size_t kept() const;

 private:
  struct Connection {
    zmq::message_t subscription;  ///< kept for connectionOf()
    int fd = -1;
  };
  struct Topic {
    std::map<const void*, Connection> connections;  ///< by connectionOf()
    std::size_t ended = 0;                          ///< how many of them have ended; it is not told which
  };
  static void add(Topic& topic, const void* connection, zmq::message_t& subscription);

  std::map<std::string, Topic, std::less<>> topics_;  ///< with a connection that has not ended
};

}  // namespace tractiond::network
