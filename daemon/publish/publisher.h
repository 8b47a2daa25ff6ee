// Sends fields, markers, description, status and previews to subscribers.
#pragma once

#include "base/clock.h"
#include "base/error.h"
#include "daemon/publish/description.h"
#include "daemon/records/ledger.h"
#include "daemon/records/preview.h"
#include "daemon/records/traction_field.h"

#include <tl/expected.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace traction::v1 {
class Status;
}

namespace tractiond::publish {

/// Sets the fields of a status that the publisher does not know. The message is that of the status before: fields that
/// are not set keep their values.
using Measure = std::function<void(traction::v1::Status&)>;

struct PublishOptions {
  std::vector<std::string> stream;  ///< ZeroMQ endpoints; port * takes a free one; ipc directories must exist
  std::vector<std::string> latest;  ///< likewise, of the newest field only
  /// Messages that may wait for one slow subscriber; further ones are lost to it. Two seconds of fields and markers at
  /// 60 frames/s, 85 ms at 1,500; they take 3 MB.
  int highWaterMark = 256;
  std::chrono::milliseconds statusInterval{1000};
  /// Shortest time between two descriptions sent for new subscribers, of all of them together.
  std::chrono::milliseconds descriptionInterval{100};
  std::int64_t (*monotonicClock)() = monotonicNow;
  std::int64_t (*realClock)() = realNow;
};

/// publish() and serve() are for one thread. describe(), lastStatus() and lastDescription() may be called from one
/// other thread, offerPreview() from one more.
class Publisher {
 public:
  /// Binds to the endpoints. Fails if one cannot be bound. The ledger must outlive this.
  /// \param measure called on the publishing thread before each status; must not wait
  static tl::expected<std::unique_ptr<Publisher>, Error>
  open(const PublishOptions& options, const Description& description, const Ledger& ledger, Measure measure);
  ~Publisher();

  /// Sends a field (stream and latest) and its markers. Never waits: a slow subscriber loses messages.
  void publish(const TractionField& field);

  /// Serves subscribers until `fd` (-1: none) is readable, something is due, or the time is over.
  void serve(int fd, std::chrono::milliseconds timeout);

  /// Replaces the description; it is sent within the next serve() or publish(). The identity stays as it was.
  void describe(const Description& description);

  /// Returns whether a subscription names previews. Thread-safe.
  bool previewWanted() const;

  /// Takes a picture to be sent within the next serve() or publish(). Returns false if the previous one has not been
  /// sent yet, or too many wait for slow subscribers.
  bool offerPreview(const Preview& preview);

  /// Returns the status that was sent last, as bytes of the message.
  std::string lastStatus() const;
  /// Returns the newest description, as bytes of the message.
  std::string lastDescription() const;

  /// Returns the endpoints as they were bound.
  const std::vector<std::string>& streamEndpoints() const;
  const std::vector<std::string>& latestEndpoints() const;

 private:
  struct Impl;
  explicit Publisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::publish
