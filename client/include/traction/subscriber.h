// Receives what an instance of tractiond publishes.
#pragma once

#include "traction/description.h"
#include "traction/error.h"
#include "traction/keys.h"
#include "traction/status.h"

#include <chrono>
#include <cstdint>
#include <memory>
#include <string_view>
#include <variant>

namespace traction {

using Message = std::variant<Field, Markers, Description, Status, Preview>;

/// Which of them; or-ed.
enum Topics : unsigned {
  kField = 1,
  kMarkers = 2,
  kDescription = 4,
  kStatus = 8,
  kAllTopics = 15,  ///< but previews: the daemon makes them while somebody wants them
  kPreview = 16,
};

enum class Mode {
  kStream,  ///< every message, in order
  kLatest,  ///< the newest field only: what was not read in time is replaced. For controllers.
};

struct SubscriberOptions {
  std::string instance = "default";  ///< of tractiond, on this machine
  std::string endpoint;              ///< ZeroMQ's, "tcp://HOST:9872"; empty: found by the instance
  Keys keys = {};                    ///< for a gateway
  Mode mode = Mode::kStream;
  unsigned topics = kAllTopics;  ///< of kStream
  int queue = 1000;              ///< messages that wait here for a slow reader before some are lost

  /// Returns CLOCK_MONOTONIC [ns], for Header::arrived_ns and for when to try an endpoint again that was given up;
  /// null: this host's. For tests. The timeout of receive() is in real time.
  std::int64_t (*monotonicClock)() = nullptr;
};

/// What was sent, to be kept or passed on.
struct Raw {
  std::string_view topic;  ///< "traction/v1/<sensor>/field/"; empty of Mode::kLatest
  std::string_view bytes;  ///< Protobuf
};

/// What it means. Empty: of a topic that this version does not know. \throws Error kVersion, kMalformed
TRACTION_EXPORT std::optional<Message> decode(const Raw& raw);

/// Not thread-safe: one thread at a time. The daemon may start later, and again: receive() goes on.
class TRACTION_EXPORT Subscriber {
 public:
  /// Does not wait for the daemon. \throws Error kBadEndpoint, kBadKeys
  explicit Subscriber(const SubscriberOptions& options = {});
  ~Subscriber();
  Subscriber(Subscriber&&) noexcept;
  Subscriber& operator=(Subscriber&&) noexcept;

  /// The next message; empty: none came within the time, or a signal handler ran. A new subscriber is sent the
  /// description at once. \throws Error kVersion, kMalformed, kNotAllowed
  std::optional<Message> receive(std::chrono::milliseconds timeout);

  /// The message that receive() has returned, or thrown at, last, as it was sent; gone at the next call.
  Raw raw() const;

  /// Messages that were sent since this subscriber joined and did not arrive, by gaps in their sequence. A restart of
  /// the daemon is no loss; neither is what Mode::kLatest passes over.
  std::uint64_t lost() const;

  /// Somebody publishes at the endpoint, whether or not there is anything to say yet.
  bool isConnected() const;

  /// Where it connects to; for messages to people.
  const std::string& endpoint() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace traction
