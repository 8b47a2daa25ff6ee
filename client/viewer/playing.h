// Plays a recording as if it were a sensor.
#pragma once

#include "client/src/sources.h"
#include "client/viewer/forwarder.h"
#include "recording/reader.h"

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace traction::view {

/// Plays the messages of the recording's first sensor, of one source alone where two have its name, from the beginning
/// and at the pace of the recording, until play() is called. At the end it waits for play(). Delivers kTime with the
/// position about five times a second, and kErrors for messages that cannot be decoded.
class Playing {
 public:
  /// Opens the file and starts the thread, which first reads the whole recording.
  /// \param deliver is called on the player's own thread
  /// \throws client::Failure if the file cannot be read or is not a recording
  Playing(const std::filesystem::path& file, Deliver deliver);
  /// Waits for the thread until it has read its chunk, or some seconds where it computes a surface, and for a call of
  /// `deliver`.
  ~Playing();
  Playing(const Playing&) = delete;
  Playing& operator=(const Playing&) = delete;

  /// Continues at `from_s` after the beginning [s], limited to the recording, at `speed` times its pace; at speed 0 it
  /// shows that moment and pauses. Returns at once; takes effect before the next message, but after the first reading
  /// of the recording. A later call replaces a request that has not begun. Thread-safe, also within `deliver`.
  /// \param from_s, speed finite, speed not below 0
  void play(double from_s, double speed);

  /// Lets the thread end as soon as it can, so that the destructor waits for less. Thread-safe.
  void stop();

  /// Adds kinds (or-ed) to those that are wanted. Only kPreview, kSurface and kPicture must be: all other kinds are
  /// always delivered. Thread-safe.
  void want(unsigned kinds) { forwarder_.want(kinds); }

 private:
  struct Request {
    double from_s = 0.0, speed = 1.0;
  };
  struct Interrupted {};

  void run(const std::stop_token& stop);
  void survey(const std::stop_token& stop);
  void show(const std::stop_token& stop, const Request& request);
  /// \throws Interrupted if there is another request, or a request to stop
  void waitUntil(const std::stop_token& stop, std::chrono::steady_clock::time_point due);
  void pass(std::string_view topic, std::string_view bytes);
  void reportTime(double at_s, double speed);
  bool isPlayed(const recording::Channel& channel, const recording::Message& message) const;

  recording::Reader reader_;
  Deliver deliver_;
  Forwarder forwarder_;
  std::string prefix_;  ///< of the topics that are played
  Sources sources_;
  std::uint64_t begin_ns_ = 0, end_ns_ = 0;
  std::map<std::uint64_t, std::string> descriptions_;  ///< by log time
  std::string trouble_;                                ///< what is wrong with the file; empty: nothing

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Request> request_ = Request();
  std::jthread thread_;  // last, as it uses the others
};

}  // namespace traction::view
