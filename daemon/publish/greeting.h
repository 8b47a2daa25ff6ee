// Does ZeroMQ's own thread behind our sockets still work? Where it hangs, messages wait, and no call of ours fails.
#pragma once

#include <cstdint>
#include <string>

namespace tractiond::publish {

/// Whoever connects is greeted by that thread first (ZMTP 3.0). Thread-bound.
class Greeting {
 public:
  /// \param endpoint ipc://PATH, as bound; of another nothing is known
  explicit Greeting(const std::string& endpoint);
  ~Greeting();
  Greeting(Greeting&& other) noexcept;
  Greeting(const Greeting&) = delete;
  Greeting& operator=(const Greeting&) = delete;

  /// Was the connection of the call before greeted? Makes the next one. Does not wait. True where that is not known.
  bool came();

 private:
  void connect();

  std::string path_;
  int socket_ = -1;
};

}  // namespace tractiond::publish
