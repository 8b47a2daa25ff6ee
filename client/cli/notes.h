// Notes on standard error about a stream that is being recorded or printed.
#pragma once

#include "traction/error.h"
#include "traction/subscriber.h"

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace traction::client {

/// Returns, but does not throw, the error kNoAnswer that no publisher was found.
/// \param endpoints and
/// \param program for the message
Error noPublisher(const std::string& endpoints, const std::string& program = "tractiond");

/// Reports connection, restarts, silence and losses of one subscriber. Not thread-safe.
class Notes {
 public:
  using Clock = std::chrono::steady_clock;

  /// The 3 s of noteConnection() begin.
  /// \param program that publishes.
  /// \param subscriber must outlive the object
  /// \param onSilence likely cause if a publisher sends nothing in these 3 s
  /// \param onLoss likely cause of losses; both are parts of sentences for the operator
  Notes(const Subscriber& subscriber, std::string onSilence, std::string onLoss, std::string program = "tractiond");

  /// Prints on standard error that the connection is lost or back, that no message has come in the first 3 s although a
  /// publisher is connected (once), a second source of one name (once), and losses, at most once per second. Must be
  /// called in every turn of the receiving loop. \throws Error kNoAnswer if no publisher is found in the first 3 s
  void noteConnection(bool isConnected, Clock::time_point now);
  /// Prints on standard error that the daemon was started again, that it has no gel file (once per start), and losses.
  /// Must be called with every message received.
  void hear(const Message& message, Clock::time_point now);

 private:
  void noteLosses(Clock::time_point now);

  const Subscriber& subscriber_;
  std::string onSilence_, onLoss_, program_;
  bool isConnected_ = false, wasConnected_ = false, heard_ = false;
  bool saidNoGel_ = false;  ///< since the last restart of the daemon
  std::optional<Id> boot_;
  std::string second_;  ///< as Subscriber::secondSource(), said
  std::uint64_t sequence_ = 0;
  std::uint64_t reported_ = 0;  ///< losses reported so far
  Clock::time_point start_ = Clock::now(), reportedAt_;
};

}  // namespace traction::client
