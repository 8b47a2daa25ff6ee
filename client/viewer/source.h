// Receives the messages of one endpoint on a thread of its own.
#pragma once

#include "traction/control.h"
#include "traction/subscriber.h"

#include <functional>
#include <optional>
#include <string>
#include <thread>

namespace traction::view {

struct SourceOptions {
  std::string name;  ///< shown to the user
  SubscriberOptions subscription;
  std::optional<ControlOptions> control;  ///< empty: no endpoint for requests is known
};

/// Receives from its construction to its destruction. Thread-bound.
class Source {
 public:
  /// Called on the source's thread. All must be set.
  struct Handlers {
    /// Called with each message; both arguments are valid during the call only.
    std::function<void(const Message& message, const Raw& raw)> pass;
    /// Called after each message and each error, and at least every 0.1 s.
    /// \param isConnected to the publisher
    std::function<void(bool isConnected)> turn = [](bool) {};
    /// Called with each error of Subscriber::receive(), after which receiving goes on.
    /// \param raw for kMalformed, the message that could not be decoded, valid during the call only; empty for all
    /// other errors
    std::function<void(const Error& error, const Raw& raw)> fail;
  };

  /// Starts the thread. Does not wait for a publisher.
  /// \throws Error kBadEndpoint, kBadKeys
  Source(const SubscriberOptions& options, Handlers handlers);
  /// Waits for the thread: 0.1 s at most, and as long as a handler takes.
  ~Source();
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;

 private:
  void listen(const std::stop_token& stop);

  Subscriber subscriber_;
  std::string second_;  ///< as Subscriber::secondSource(), told
  Handlers handlers_;
  std::jthread thread_;  // last, as it uses the others
};

}  // namespace traction::view
