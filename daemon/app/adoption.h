// Keeps a gel file that a client asks to adopt, and says when the daemon is to start again with it.
#pragma once

#include "base/background_thread.h"
#include "daemon/records/frame.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <future>
#include <optional>
#include <string>

namespace tractiond {

/// A gel file that is to be kept, and the camera that it was checked against.
struct Adopted {
  std::string gelFile;  ///< its text
  sensor::Sensor sensor;
  PixelFormat format;
  std::string camera;  ///< sensor::MeasuredWith::text()
};

/// Bound to the control thread, except for isDue().
class Adoption {
 public:
  /// Replaces the file on a thread of its own, as a disk may take seconds, and removes zeros of other markers from its
  /// directory, with which the daemon would not start. Must not be called while one is under way.
  void begin(const std::filesystem::path& path, Adopted adopted);
  /// Returns the outcome, once: the file is kept, or why it could not be written. Does not wait.
  std::optional<tl::expected<void, std::string>> turn();
  /// Returns whether the daemon is to start again: a gel file has been kept for as long as the answer to the client
  /// takes on its way. Any thread.
  bool isDue() const;

 private:
  std::optional<BackgroundThread> writer_;
  std::future<tl::expected<void, std::string>> written_;
  std::atomic<std::int64_t> kept_ns_{0};  ///< 0: none yet
};

}  // namespace tractiond
