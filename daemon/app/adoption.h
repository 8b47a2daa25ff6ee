// Puts a gel file in force that a client sends, and the one before again where the daemon does not start with it.
#pragma once

#include "base/background_thread.h"
#include "daemon/capture/camera_info.h"

#include <tl/expected.hpp>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <future>
#include <optional>
#include <string>

namespace tractiond {

/// Bound to the control thread, except for isDue().
class Adoption {
 public:
  /// \param program of the child process that checks a gel file: tractiond
  explicit Adoption(std::string program = "/proc/self/exe")
      : program_(std::move(program)) {}

  /// Checks a gel file, first in a child process, as it may crash or occupy what reads it, and keeps it at `path`; what
  /// was kept before, and has run, is kept as its earlierGel(). Removes zeros of other markers from the directory, with
  /// which the daemon would not start. Works on a thread of its own. Must not be called while one is under way.
  void begin(const std::filesystem::path& path, std::string gelFile, const capture::CameraInfo& camera);
  /// Returns the outcome, once: the file is kept, or why it is refused or could not be written. Does not wait.
  std::optional<tl::expected<void, std::string>> turn();
  /// Returns whether the daemon is to start again: a gel file has been kept for as long as the answer to the client
  /// takes on its way. Any thread.
  bool isDue() const;

 private:
  std::string program_;
  std::optional<BackgroundThread> writer_;
  std::future<tl::expected<void, std::string>> written_;
  std::atomic<std::int64_t> kept_ns_{0};  ///< 0: none yet
};

/// Returns where the gel file is kept that was in force before `adopted`.
std::filesystem::path earlierGel(const std::filesystem::path& adopted);

// A gel file that was adopted is on trial until the daemon has run with it. A file beside it, of one byte for each
// start, counts them. The functions do nothing for an empty path, and for a gel file that is not on trial.

/// Returns whether a gel file is on trial.
bool isOnTrial(const std::filesystem::path& adopted);
/// Counts a start. After two puts the gel file aside instead, as PATH.refused, and the one before in its place; returns
/// a sentence then, else nothing.
std::string countStart(const std::filesystem::path& adopted);
/// Takes the last start back: that it did not reach its end is not the gel file's fault.
void forgetStart(const std::filesystem::path& adopted);
/// Ends the trial: the daemon runs.
void endTrial(const std::filesystem::path& adopted);

}  // namespace tractiond
