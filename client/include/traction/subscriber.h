// Receives the messages that an instance of tractiond publishes, and the contacts that traction-touch makes of them.
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

using Message = std::variant<Field, Markers, Description, Status, Preview, Contacts, Grasp>;

/// The topics to receive, combined by bitwise or.
enum Topics : unsigned {
  kField = 1,
  kMarkers = 2,
  kDescription = 4,
  kStatus = 8,
  /// All but previews, which the daemon makes only while a client subscribes to them, and contacts and grasps, which
  /// are of another program.
  kAllTopics = 15,
  kPreview = 16,
  // Each connects to the instance's traction-touch, too; without topics of tractiond: to nothing else.
  kContacts = 32,
  kGrasp = 64,    ///< `instance` is the name of a hand
  kOfTouch = 96,  ///< both of these
};

enum class Mode {
  kStream,  ///< every message, in order
  /// The newest field only: an unread field is replaced by the next one. For controllers.
  kLatest,
};

struct SubscriberOptions {
  std::string instance = "default";  ///< name of a tractiond on this machine
  /// ZeroMQ endpoint of the stream, or of the newest field for Mode::kLatest, "tcp://HOST:9872" or "ipc:///PATH";
  /// empty: found from `instance`.
  std::string endpoint;
  Keys keys = {};  ///< needed for a traction-gateway only
  Mode mode = Mode::kStream;
  /// Topics that receive() returns. For kStream; kLatest receives fields only. Other topics that are published are sent
  /// to this host nevertheless, and take room in `queue`.
  unsigned topics = kAllTopics;
  int queue = 1000;  ///< messages stored for a slow reader, 0 or more; further ones are lost. For kStream; 0: no limit
  /// Also messages of a second source that has the name of another one (Subscriber::secondSource()).
  bool allSources = false;

  /// Returns CLOCK_MONOTONIC [ns]; null: this host's clock. For tests: it sets Header::arrived_ns and the time of
  /// reconnections. The timeout of receive() is in real time in any case.
  std::int64_t (*monotonicClock)() = nullptr;
};

/// A message as it was sent, to be stored or forwarded. The views belong to whatever made them: see Subscriber::raw().
struct Raw {
  std::string_view topic;  ///< "traction/v1/<sensor>/field/"; empty in Mode::kLatest
  std::string_view bytes;  ///< Protobuf message
};

/// Decodes a message of Mode::kStream. Returns nothing for a topic that this version does not know. Header::arrived_ns
/// is 0. The result does not refer to `raw`. Reentrant.
/// \throws Error kVersion if the topic is not one of this protocol version, kMalformed if the bytes are not a valid
/// message of the topic
TRACTION_EXPORT std::optional<Message> decode(const Raw& raw);

/// Subscriber of one instance. Not thread-safe: only one thread may use it at a time. It connects, and connects again,
/// whenever the daemon runs.
///
/// Of contacts, each that begins ends once, whatever happens to traction-touch and to messages: one that was there
/// before begins when it is first seen; one that is missing in a message, or is of another run, ends in it; and all end
/// in a message of the library's own, for which raw() is empty, after a second without a message of traction-touch.
class TRACTION_EXPORT Subscriber {
 public:
  /// Starts to connect and returns at once, whether or not the daemon runs.
  /// \param options are copied
  /// \throws Error kBadEndpoint if the endpoint or the instance's name is invalid, kBadKeys if a key is, kNoAnswer if
  /// no file descriptors or memory are left for ZeroMQ
  explicit Subscriber(const SubscriberOptions& options = {});
  /// Disconnects; messages that were not received are lost. Does not wait for the daemon.
  ~Subscriber();
  /// A subscriber that was moved from may only be assigned to or destroyed.
  Subscriber(Subscriber&&) noexcept;
  Subscriber& operator=(Subscriber&&) noexcept;

  /// Waits for the next message. Returns nothing if none arrives within `timeout`, or if a signal interrupts the wait.
  /// In Mode::kStream the daemon sends a new subscriber the description at once. After an error it may be called again,
  /// and goes on with the next message.
  /// \param timeout above 10^12 ms: 10^12 ms; 0 or negative: does not wait
  /// \throws Error kVersion, kMalformed, kNotAllowed; kBadEndpoint for the endpoint of Mode::kLatest; kNoAnswer if no
  /// memory is left for ZeroMQ
  std::optional<Message> receive(std::chrono::milliseconds timeout);

  /// Returns the message that receive() returned or rejected last, as it was sent. It is valid until the next call of
  /// receive(). Empty before the first message, and after receive() has returned nothing.
  Raw raw() const;

  /// Returns the number of messages that were lost on the way since the first one received, by gaps in Header::sequence
  /// of each received topic. Messages that receive() rejected count as well, restarts of the daemon do not; in
  /// Mode::kLatest it is always 0.
  std::uint64_t lost() const;

  /// Returns a sentence that names two daemons that have one sensor.name, or two traction-touch, if there were such:
  /// the one heard first is received, and the other, but for its first message, is left out while that sends. Else
  /// empty.
  const std::string& secondSource() const;

  /// Returns whether a publisher is connected, even if it has sent nothing yet; where contacts are received besides
  /// others, whether tractiond is. Does not wait. For the thread that uses the subscriber, although it is const.
  bool isConnected() const;

  /// Returns the endpoint that it connects to, for messages; the last one if the instance may be at several.
  const std::string& endpoint() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace traction
