// Makes recordings of sensors, and lists those that exist.
#pragma once

#include "client/files/tape.h"

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
  std::filesystem::file_time_type written;  ///< when it was written last
};

/// Lists the recordings (*.mcap) of a directory, newest first, at most 200; none where the directory cannot be read.
std::vector<RecordingFile> recordingsIn(const std::filesystem::path& directory);

/// Returns the name of a recording that begins now, in UTC: "SENSOR-2026-11-23T01-46-29.mcap". Characters of `sensor`
/// other than letters, digits, '-' and '_' become '-'.
std::string recordingName(const std::string& sensor);

/// Records every message of a sensor, and its previews, on a thread of its own.
class Recording {
 public:
  /// Creates the file, which must not exist yet, and starts; does not wait for the daemon. Ignores the errors of
  /// Subscriber::receive(): messages that cannot be decoded are left out.
  /// \param options whose topics and queue are ignored
  /// \throws client::Failure, Error kBadEndpoint, kBadKeys
  Recording(const SubscriberOptions& options, const std::filesystem::path& file);
  /// Calls finish().
  ~Recording() { finish(); }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  struct State {
    std::string account;               ///< client::Tape::account(); empty before the first turn of the thread
    std::optional<std::string> error;  ///< why the recording has ended by itself
  };
  /// Returns a copy of the state. Does not wait for the disk. Thread-safe.
  State state() const;

  /// Returns the file's name, without its directory.
  const std::string& name() const { return name_; }

  /// Ends the recording, waits for the disk, and removes the file if it has no message; state() is then final. Further
  /// calls have no effect. Not thread-safe.
  void finish();

 private:
  void run(const std::stop_token& stop);

  std::string name_;
  Subscriber subscriber_;
  client::Tape tape_;
  mutable std::mutex mutex_;
  State state_;
  std::jthread thread_;  // last, as it uses the others
};

}  // namespace traction::view
