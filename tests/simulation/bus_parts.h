// Sockets and connections of the bus. For bus*.cpp alone.
#pragma once

#include "tests/simulation/bus.h"

namespace tractiond::simulation {

struct Bus::Socket {
  int type = 0, port = 0;
  std::string endpoint;
  std::int64_t largest = -1;
  std::size_t highWaterMark = 1000;
  bool conflates = false;
  bool isVerbose = false;          ///< each subscription is told, not only the first one of its topic
  std::vector<Connection*> connections;
  Message outgoing;                            ///< parts of a message that is not complete
  std::deque<Part> incoming;                   ///< parts of the message that is being received
  std::deque<Message> subscriptions;           ///< and cancellations, in their order
  std::deque<std::shared_ptr<Inbox>> inboxes;  ///< the first one is to be served next
  std::map<std::string, Connection*> routes;
  std::uint64_t routesSoFar = 0;
};

struct Bus::Connection {
  Socket* socket;
  Peer* peer;
  std::shared_ptr<const std::string> address;
  std::int64_t reads_bytesPerMs;
  int id;
  bool hasEnded = false;
  std::string route = {};
  std::shared_ptr<Inbox> inbox = {};
  std::vector<std::string> subscriptions = {};
  struct Waiting {
    Message message;
    std::uint64_t number;
  };
  std::deque<Waiting> queue = {};  ///< that libzmq holds
  struct Written {
    std::vector<std::string> parts;
    std::size_t bytes;
    std::uint64_t number;
  };
  std::deque<Written> kernel = {};
  std::size_t kernel_bytes = 0, isRead_bytes = 0;  ///< of the first one
  std::int64_t passed_ns = 0;                      ///< in which it has read nothing yet
};

}  // namespace tractiond::simulation
