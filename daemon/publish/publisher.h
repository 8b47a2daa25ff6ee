// Sends fields, markers, description, status and previews to whoever subscribes.
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

/// Sets in a status what the publisher does not know by itself. The message is the one of the status before: what is
/// not set stays as it was.
using Measure = std::function<void(traction::v1::Status&)>;

struct PublishOptions {
  std::vector<std::string> stream;  ///< ZeroMQ endpoints; port * takes a free one; ipc directories exist
  std::vector<std::string> latest;
  /// Messages that wait for one slow subscriber before it loses some: two seconds of fields and markers at 60 frames/s,
  /// 85 ms at 1,500; they hold 3 MB.
  int highWaterMark = 256;
  std::chrono::milliseconds statusInterval{1000};
  /// New subscribers get the description at once, but all of them together not more often than this.
  std::chrono::milliseconds descriptionInterval{100};
  std::int64_t (*monotonicClock)() = monotonicNow;
  std::int64_t (*realClock)() = realNow;
};

/// Thread-bound: publish() and serve() belong to one thread. describe(), lastStatus() and lastDescription() may be
/// called from one other, offerPreview() from one more.
class Publisher {
 public:
  /// \param measure called on the publishing thread before each status; must not wait \param ledger must outlive this
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

  /// Takes a picture to be sent within the next serve() or publish(). False: that before has not been sent yet, or too
  /// many wait for slow subscribers.
  bool offerPreview(const Preview& preview);

  /// The messages as bytes, for the control socket.
  std::string lastStatus() const;
  std::string lastDescription() const;

  /// As bound.
  const std::vector<std::string>& streamEndpoints() const;
  const std::vector<std::string>& latestEndpoints() const;

 private:
  struct Impl;
  explicit Publisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::publish
