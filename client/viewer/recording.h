// A sensor's recording that grows, and those that are there.
#pragma once

#include "client/cli/tape.h"

#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace traction::view {

struct RecordingFile {
  std::string name;  ///< in its directory
  std::uintmax_t bytes = 0;
  std::filesystem::file_time_type written;
};

/// The newest first, at most 200. Empty: there are none, or no directory.
std::vector<RecordingFile> recordingsIn(const std::filesystem::path& directory);

/// "SENSOR-2026-11-23T01-46-29.mcap", now
std::string recordingName(const std::string& sensor);

/// Takes down every message of a sensor, and its previews, on a thread of its own until it is destroyed.
class Recording {
 public:
  /// A new file. \throws cli::RecordingError, Error kBadEndpoint, kBadKeys
  Recording(const SubscriberOptions& options, const std::filesystem::path& file);
  /// Closes the file; without a message there is none.
  ~Recording() { finish(); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  struct State {
    std::string account;               ///< for people
    std::optional<std::string> error;  ///< it has ended by itself
  };
  /// Thread-safe.
  State state() const;

  const std::string& name() const { return name_; }

  /// Ends it. What is on the disk. Not for two threads at a time.
  State finish();

 private:
  void run(const std::stop_token& stop);

  std::string name_;
  Subscriber subscriber_;
  cli::Tape tape_;
  mutable std::mutex mutex_;
  State state_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace traction::view
