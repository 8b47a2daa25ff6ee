// Limits the number of connections, in total and per address.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tractiond::gateway {

/// Counts connections. Thread-bound.
class Peers {
 public:
  /// \param most connections in total \param mostPerAddress connections from one IP address
  Peers(int most, int mostPerAddress)
      : most_(most)
      , mostPerAddress_(mostPerAddress) {}

  /// Registers a connection that ZeroMQ accepted on a socket bound to `bound`. If it exceeds a limit, ends it and
  /// counts it as refused instead; ignores it if it has ended, and its descriptor may be another socket's. \param fd
  /// file descriptor of the connection \param bound must outlive this object: its address identifies the socket
  void came(int fd, const std::vector<std::string>& bound);
  /// Removes a closed connection of that socket. Ignores `fd` if it is not registered, or belongs to another socket's
  /// connection by now.
  void went(int fd, const std::vector<std::string>& bound);
  /// Removes connections that ended without an event. Makes two system calls for each connection; does not wait.
  void removeEnded();

  /// Returns the number of connections at present.
  int count() const { return static_cast<int>(connections_.size()); }
  /// Returns the number of connections refused so far.
  std::uint64_t refused() const { return refused_; }
  /// Returns the IP address of the last refused connection; empty: none was refused.
  const std::string& lastRefused() const { return lastRefused_; }

 private:
  struct Connection {
    std::string address;
    std::uint64_t cookie = 0;  ///< network::cookieOf(): the descriptor's number may become another connection's
    const std::vector<std::string>* bound = nullptr;  ///< endpoints of its socket
  };
  void forget(int fd);

  int most_, mostPerAddress_;
  std::map<int, Connection> connections_;  ///< by file descriptor
  std::map<std::string, int> each_;        ///< address -> number of connections
  std::uint64_t refused_ = 0;
  std::string lastRefused_;
};

}  // namespace tractiond::gateway
