// Liveness check of ZeroMQ's own thread behind this program's sockets: if it hangs, messages wait, and no call fails.
#pragma once

#include <cstdint>
#include <string>

namespace tractiond::publish {

/// Connects as a client: that thread sends a greeting to every new connection (ZMTP 3.0). Thread-bound.
class Greeting {
 public:
  /// Does not connect yet: the first poll() does. \param endpoint ipc://PATH, as bound; other kinds, ipc://@NAME among
  /// them, are not checked, and neither is a path that is too long for a socket
  explicit Greeting(const std::string& endpoint);
  ~Greeting();
  Greeting(Greeting&& other) noexcept;  ///< Takes over the connection; `other` has none afterwards.
  Greeting(const Greeting&) = delete;
  Greeting& operator=(const Greeting&) = delete;

  /// Returns whether the connection that an earlier call made has been greeted or closed, and if so makes the next one;
  /// false: ZeroMQ's thread has not answered yet. Returns true if there is no connection: in the first call, for
  /// endpoints that are not checked, and if the last one was not accepted. Does not wait.
  bool poll();

 private:
  void connect();

  std::string path_;
  int socket_ = -1;
};

}  // namespace tractiond::publish
