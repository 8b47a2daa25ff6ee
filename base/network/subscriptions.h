// Tracks which connections subscribe to topics.
#pragma once

#include <zmq.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

namespace tractiond::network {

/// Tracks subscriptions by connection: a publisher with ZMQ_XPUB_VERBOSER receives repeated subscriptions, and
/// cancellations of what was not subscribed to, as well, so that they cannot be counted. Thread-bound.
class Subscriptions {
 public:
  /// Notes a subscription (\1TOPIC) or cancellation (\0TOPIC) that the publisher has received; ignores other messages.
  /// When a connection ends, ZeroMQ makes a cancellation of each of its topics, without a source: calls removeEnded().
  void note(zmq::message_t& message);
  /// Removes the subscriptions of connections that have ended, and of which no message waits. Makes a system call for
  /// each subscription.
  void removeEnded();
  /// Returns whether no connection has a subscription. One that has ended may count until the next removeEnded().
  bool empty() const;

 private:
  struct Connection {
    /// cookieOf(): the descriptor's number may become another connection's. 0: it had ended when its subscription was
    /// received, and that will be told.
    std::uint64_t cookie = 0;
    bool mayBeWrong = false;  ///< it may have been another's already when the subscription was received
  };
  struct Topic {
    std::map<int, Connection> connections;  ///< by file descriptor
    /// Ends of connections that were told, less those that were removed. Above 0: so many of `connections` are wrong.
    int ended = 0;
  };
  /// \param one of Topic::connections
  static bool hasEnded(const std::pair<const int, Connection>& one);
  static void removeEnded(Topic& topic);

  std::map<std::string, Topic, std::less<>> topics_;
};

}  // namespace tractiond::network
