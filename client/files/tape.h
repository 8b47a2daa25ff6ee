// Writes a stream into a recording.
#pragma once

#include "recording/writer.h"
#include "traction/subscriber.h"

#include <map>
#include <string>

namespace traction::client {

/// Writes one recording. Thread-bound. The constructor, add(), flushIfDue() and close() throw
/// Failure (EX_CANTCREAT, EX_IOERR). The recording is then closed with what was written, and deleted if nothing
/// was; of the functions that throw, none may be called afterwards. Without close(), what is buffered is lost, and the
/// file has no end.
class Tape {
 public:
  /// Creates a new file, which must not exist yet (EX_CANTCREAT), in an existing directory.
  explicit Tape(const std::string& path);

  /// Adds a copy of a message with its sequence number; may write those before it, and wait for the disk. Log time:
  /// when it arrived. Publish time: captureTime_ns(), or the log time if that is not known and for descriptions and
  /// statuses. Leaves out the library's own ends of contacts, which have no topic.
  /// \param message of a Subscriber
  /// \param raw topic and bytes of `message`
  void add(const Message& message, const Raw& raw);
  /// Writes the buffered messages if the oldest is 0.15 s old, and waits for the disk; does nothing otherwise. Must be
  /// called in every turn of the receiving loop.
  void flushIfDue();
  /// Writes what is buffered and the end of the recording, and waits for the disk. Keeps the file if it has no message.
  void close();

  /// Deletes the file if no message was added; has no effect otherwise. An error is ignored.
  void drop() const;
  /// Returns whether no message was added.
  bool isEmpty() const { return writer_.statistics().messages == 0 && !writer_.oldest_ns(); }
  /// Returns a summary of what is on the disk, as text: "1200 messages of 10.0 s, 4.2 MB".
  std::string account() const;
  /// Returns the longest time from a message's arrival until it was on the disk [s]; 0 before the first write.
  double longestWait_s() const { return 1e-9 * static_cast<double>(longest_ns_); }

 private:
  /// Returns calendar time that advances with CLOCK_MONOTONIC from the start on, so that it never goes back [ns since
  /// 1970].
  std::uint64_t logNow() const;
  template <typename Write>
  void watch(const Write& write);
  void check(const tl::expected<void, recording::Error>& written);

  std::string path_;
  recording::NewFile file_;
  recording::Writer writer_{file_, {.library = "tractionctl"}};
  std::map<std::string, std::uint16_t> schemas_, channels_;
  std::int64_t epoch_ns_;
  std::uint64_t longest_ns_ = 0;
};

}  // namespace traction::client
