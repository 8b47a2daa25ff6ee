// Sends fields, markers, description, status and previews to subscribers.
#pragma once

#include "base/clock.h"
#include "base/error.h"
#include "daemon/publish/description.h"
#include "daemon/publish/newest_messages.h"
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
  /// ZeroMQ endpoints: "ipc://PATH", whose directory must exist, or "tcp://ADDRESS:PORT"; port * takes a free one.
  std::vector<std::string> stream;
  std::vector<std::string> latest;  ///< likewise, of the newest field only
  /// Messages that may wait for one slow subscriber; further ones are lost to it. Two seconds of fields and markers at
  /// 60 frames/s, 85 ms at 1,500; they take 3 MB.
  int highWaterMark = 256;
  std::chrono::milliseconds statusInterval{1000};  ///< time between two statuses
  /// Shortest time between two descriptions sent for new subscribers, of all of them together.
  std::chrono::milliseconds descriptionInterval{100};
  std::int64_t (*monotonicClock)() = monotonicNow;  ///< [ns], of the messages' monotonic times and these intervals
  std::int64_t (*realClock)() = realNow;            ///< [ns], of the messages' times of day
};

/// publish() and serve() are for one thread. describe() may be called from one other thread, offerPreview() from one
/// more. lastStatus(), lastDescription(), previewWanted() and the endpoints are thread-safe.
class Publisher final : public NewestMessages {
 public:
  /// Binds to the endpoints, and sends the description and a first status. The ledger must outlive this, the
  /// description need not; its sensor's name must be valid (traction::isValidName()), as loadConfig(), located() and
  /// replay() see to it: another one is a bug, and no error. EX_CONFIG: an endpoint is malformed. EX_UNAVAILABLE: it is
  /// in use, or not an address of this machine. EX_CANTCREAT, EX_NOPERM: its file cannot be made. EX_OSERR: ZeroMQ
  /// cannot start.
  /// \param measure called on the publishing thread before each status, and once within open(); must not wait; may be
  /// empty
  static tl::expected<std::unique_ptr<Publisher>, Error>
  open(const PublishOptions& options, const Description& description, const Ledger& ledger, Measure measure);
  ~Publisher();  ///< Closes the sockets and removes their files.

  /// Sends a field (stream and latest) and its markers (stream). Then handles subscriptions, and sends what is due of
  /// description, status and previews. Never waits: a slow subscriber loses messages.
  void publish(const TractionField& field);

  /// Waits until `fd` (-1: none) is readable, a subscription arrives, a description or status is due, or `timeout` is
  /// over; then serves subscribers, and sends what is due. Returns early when a signal arrives. Does not read from
  /// `fd`.
  void serve(int fd, std::chrono::milliseconds timeout);

  /// Replaces the description; it is sent within the next serve() or publish(), the newest one alone if several came.
  /// The identity stays as it was. Allocates; does not wait for the publishing thread.
  void describe(const Description& description);

  /// Returns whether a subscription names previews; one to all topics of the sensor does not.
  bool previewWanted() const;

  /// Takes a picture to be sent within the next serve() or publish(). Returns whether it was taken: false, and the
  /// picture is dropped, if the previous one has not been sent yet, or 64 wait for slow subscribers. Encodes it within
  /// the call, so it need not outlive it. Allocates.
  bool offerPreview(const Preview& preview);

  std::string lastStatus() const override;
  std::string lastDescription() const override;

  /// Return the endpoints as they were bound, in the order of the options, with the number of a port that was taken
  /// for *. Valid as long as the publisher; unchanged after open().
  const std::vector<std::string>& streamEndpoints() const;
  const std::vector<std::string>& latestEndpoints() const;

 private:
  struct Impl;
  explicit Publisher(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace tractiond::publish
