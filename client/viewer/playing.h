// A recording as a sensor whose time can be chosen.
#pragma once

#include "client/viewer/forwarder.h"
#include "recording/reader.h"

#include <condition_variable>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace traction::view {

/// Of a recording of several sensors the first one's messages. Plays from the beginning at its own pace until told
/// otherwise.
class Playing {
 public:
  /// \param deliver is called on its own thread
  /// \throws cli::RecordingError: it cannot be read, or is none
  Playing(const std::filesystem::path& file, Deliver deliver);
  /// Waits for its thread: for the reading of a chunk, some seconds where a surface is being computed.
  ~Playing();
  Playing(const Playing&) = delete;
  Playing& operator=(const Playing&) = delete;

  /// Goes on there, at so many times its own pace. 0: shows that moment, and stands. Thread-safe.
  void play(double from_s, double speed);

  /// Delivers kSurface, or kPicture, from now on. Thread-safe.
  void wantSurface() { forwarder_.wantSurface(); }
  void wantPicture() { forwarder_.wantPicture(); }

 private:
  struct Wish {
    double from_s = 0.0, speed = 1.0;
  };
  struct Interrupted {};

  void run(const std::stop_token& stop);
  void look(const std::stop_token& stop);
  void show(const std::stop_token& stop, const Wish& wish);
  /// \throws Interrupted: there is another wish, or an end
  void waitUntil(const std::stop_token& stop, std::chrono::steady_clock::time_point due);
  void pass(std::string_view topic, std::string_view bytes);
  void tell(double at_s, double speed);
  bool isOurs(const std::string& topic) const;

  recording::Reader reader_;
  Deliver deliver_;
  Forwarder forwarder_;
  std::string prefix_;  ///< of the sensor's topics
  std::uint64_t begin_ns_ = 0, end_ns_ = 0;
  std::map<std::uint64_t, std::string> descriptions_;  ///< by log time: a recording has few of them
  std::string trouble_;

  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Wish> wish_ = Wish();
  std::jthread thread_;  // last: it uses the others
};

}  // namespace traction::view
