// Who is connected: so many at most, and so many from one address.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace tractiond::gateway {

/// Thread-bound.
class Peers {
 public:
  Peers(int most, int mostPerAddress)
      : most_(most)
      , mostPerAddress_(mostPerAddress) {}

  /// A connection that ZeroMQ accepted for a socket bound to these endpoints; one too many is ended.
  void came(int fd, const std::vector<std::string>& bound);
  /// A connection to these; the number may be that of another's by now.
  void went(int fd, const std::vector<std::string>& bound);
  /// Forgets all that are gone without a word.
  void look();

  int count() const { return static_cast<int>(connections_.size()); }
  std::uint64_t refused() const { return refused_; }
  const std::string& lastRefused() const { return lastRefused_; }  ///< an address

 private:
  struct Connection {
    std::string address, port;
    const std::vector<std::string>* bound = nullptr;  ///< to which it is
  };
  void forget(int fd);
  static Connection otherEnd(int fd);

  int most_, mostPerAddress_;
  std::map<int, Connection> connections_;  ///< by file descriptor
  std::map<std::string, int> each_;        ///< of an address
  std::uint64_t refused_ = 0;
  std::string lastRefused_;
};

}  // namespace tractiond::gateway
