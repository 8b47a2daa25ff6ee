// A recording of a stream that grows.
#pragma once

#include "recording/writer.h"
#include "traction/subscriber.h"

#include <map>
#include <string>

namespace traction::cli {

/// Thread-bound. All but the last three \throw RecordingError; then what was written is closed, and nothing else is
/// left to do.
class Tape {
 public:
  /// A new file.
  explicit Tape(const std::string& path);

  void add(const Message& message, const Raw& raw);
  /// A line of traction-twin's, JSON.
  void addTruth(const std::string& line);
  /// In every turn: by so much a chunk may be late.
  void look();
  void close();

  /// A recording of nothing is no recording.
  void drop() const;
  bool isEmpty() const { return writer_.statistics().messages == 0 && !writer_.oldest_ns(); }
  /// What is on the disk, for people.
  std::string account() const;
  /// From a message's arrival to the moment at which it outlives a power cut, the longest [s].
  double longestWait_s() const { return 1e-9 * static_cast<double>(longest_ns_); }

 private:
  /// By CLOCK_MONOTONIC from the beginning on: never back, whatever happens to the time of day.
  std::uint64_t logNow() const;
  template <typename Declare>
  std::uint16_t channelOf(const std::string& topic, const Declare& declare);
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

}  // namespace traction::cli
