// Simulates what libzmq does between the daemon's sockets and its peers: queues with limits, subscriptions,
// the order of requests, connections that end. zmq.cpp defines the program's calls of libzmq
// by it.
#pragma once

#include "tests/simulation/world.h"

#include <zmq.h>

#include <deque>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::simulation {

/// Bytes of a part of a message, which its copies share.
class Content {
 public:
  explicit Content(std::size_t size);
  explicit Content(std::string_view bytes);
  /// Uses the memory where it is, and calls `free`, unless it is nullptr, at the end.
  Content(void* data, std::size_t size, zmq_free_fn* free, void* hint);
  ~Content();
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;

  char* data() { return data_; }
  std::size_t size() const { return size_; }
  std::string_view view() const { return {data_, size_}; }
  /// Returns the bytes of all contents that exist: what libzmq holds.
  static std::size_t held_bytes();

 private:
  std::unique_ptr<char[]> own_;
  char* data_;
  std::size_t size_;
  zmq_free_fn* free_ = nullptr;
  void* hint_ = nullptr;
};

struct Part {
  std::shared_ptr<Content> content;
  bool more = false;                                ///< another part of the message follows
  std::shared_ptr<const std::string> address = {};  ///< of the peer that sent it
};
using Message = std::vector<Part>;

/// A program at the other end of a connection.
class Peer {
 public:
  virtual ~Peer() = default;
  /// Called when it has read a message. Must not call the bus. \param number of the message; all peers that read it
  /// are told the same one
  virtual void heed(std::span<const std::string_view> parts, std::uint64_t number) = 0;
};

/// Bytes per millisecond that a peer reads.
inline constexpr std::int64_t kAtOnce = -1, kReadsNothing = 0;

class Bus {
 public:
  Bus();
  ~Bus();

  // For peers.

  /// Connects to a port. Returns the number of the connection, which no other one gets; -1 if nobody listens. \param
  /// peer must outlive the connection \param address as ZeroMQ tells it
  int connect(int port, Peer& peer, const std::string& address, std::int64_t reads_bytesPerMs);
  /// Sends a message of some parts. No effect if the connection has ended.
  void send(int id, std::span<const std::string> parts);
  /// Ends a connection, as its peer wants.
  void disconnect(int id);
  /// Returns whether the daemon has ended the connection. It must be given up by disconnect() all the same.
  bool hasEnded(int id) const;
  /// Lets slow peers read for the time that has passed.
  void turn();
  /// Returns whether a subscription or cancellation waits to be noticed by the daemon.
  bool hasSubscriptions() const;
  /// Returns the number of requests that wait to be taken by the daemon.
  std::size_t waitingRequests() const;
  /// Returns whether any socket of the program can receive.
  bool isReadable() const;

  // For the calls of libzmq. They return what those return.

  struct Socket;
  Socket* open(int type);
  void close(Socket* socket);
  int set(Socket& socket, int option, const void* value, std::size_t size);
  int get(const Socket& socket, int option, void* value, std::size_t* size) const;
  int bind(Socket& socket, const std::string& endpoint);
  void send(Socket& socket, Part part);
  bool receive(Socket& socket, Part& part);
  bool canReceive(const Socket& socket) const;

 private:
  struct Connection;
  /// Whole requests of a connection, which stay when it ends.
  struct Inbox {
    std::deque<Message> messages;
    bool hasEnded = false;
  };

  Connection* find(int id);
  const Connection* find(int id) const;
  void arrive(Connection& connection, std::span<const std::string> parts);
  void end(Connection& connection);
  static void cancel(Socket& socket, const std::string& topic);

  void dispatch(Socket& socket, Message message);
  void offer(Connection& connection, const Message& message, std::uint64_t number);
  static void fillKernel(Connection& connection);
  static void read(Connection& connection, std::int64_t passed_ns);

  std::map<int, Connection> connections_;  ///< by number
  std::set<int> slow_;                     ///< those whose peers read slowly
  int last_ = 0;                           ///< number of the newest connection
  std::uint64_t messages_ = 0;
  std::int64_t turned_ns_;
  std::vector<std::unique_ptr<Socket>> sockets_;
};

/// Returns the pointer to the bus that the daemon's sockets are on, which may be set. The bus must outlive the daemon.
Bus*& bus();

}  // namespace tractiond::simulation
