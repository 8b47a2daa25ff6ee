// Makes recordings of sensors, and lists those that exist.
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
  std::string name;  ///< file name in the directory
  std::uintmax_t bytes = 0;
  std::filesystem::file_time_type written;
};

/// Lists the recordings of a directory, newest first, at most 200; none where the directory cannot be read.
std::vector<RecordingFile> recordingsIn(const std::filesystem::path& directory);

/// Names a recording that begins now: "SENSOR-2026-11-23T01-46-29.mcap".
std::string recordingName(const std::string& sensor);

/// Records every message of a sensor, and its previews, on a thread of its own.
class Recording {
 public:
  /// Creates the file and starts. \throws cli::RecordingError, Error kBadEndpoint, kBadKeys
  Recording(const SubscriberOptions& options, const std::filesystem::path& file);
  /// Finishes the recording. Removes the file if it has no message.
  ~Recording() { finish(); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  struct State {
    std::string account;               ///< size and losses, in words
    std::optional<std::string> error;  ///< why the recording has ended by itself
  };
  /// Thread-safe.
  State state() const;

  const std::string& name() const { return name_; }

  /// Ends the recording, waits for the disk, and returns the final state. Not thread-safe.
  State finish();

 private:
  void run(const std::stop_token& stop);

  std::string name_;
  Subscriber subscriber_;
  cli::Tape tape_;
  mutable std::mutex mutex_;
  State state_;
  std::jthread thread_;  // last, as it uses the others
};

}  // namespace traction::view
