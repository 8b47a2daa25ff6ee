// Simulates the camera, and the transport of its pictures.
#pragma once

#include "daemon/capture/driver.h"
#include "tests/simulation/gel.h"
#include "tests/simulation/ongoing.h"

#include <array>
#include <deque>

namespace tractiond::simulation {

inline constexpr int kBuffers = 10;
inline constexpr std::int64_t kFrame_ns = 4 * kMs;  ///< time that the packets of a frame take

/// The true content of a picture, for the laws.
struct Picture {
  std::uint64_t number = 0;  ///< count of all pictures, which only the simulation knows
  std::uint64_t taken = 0;   ///< number of pictures that the camera itself had taken
  double force_N = 0.0;
  bool isFew = false;
  std::int64_t at_ns = 0;  ///< when it was whole
  std::size_t noise = 0;
  std::array<std::uint8_t, 64> bytes{};
};

struct OnItsWay {
  std::int64_t at_ns = 0;
  capture::Arrival arrival;
  Picture picture;
};

class Camera {
 public:
  /// All references must outlive it.
  Camera(const Gel& gel, const Ongoing& ongoing, Chance& chance);

  /// Lets the camera stream, and continue its count, from `streamsFrom_ns`; its pictures arrive from `from_ns`, when it
  /// has been set up, until disconnect().
  void connect(std::int64_t streamsFrom_ns, std::int64_t from_ns);
  void disconnect();

  /// Applies an event to the camera.
  void apply(const Happening& one);
  /// Takes the pictures that are due.
  void turn();
  /// Returns when turn() has something to do; kNever: it has not.
  std::int64_t next_ns() const { return nextPicture_ns_; }

  /// Returns when the next picture arrives; kNever: none is under way.
  std::int64_t arrives_ns() const { return queue_.empty() ? kNever : queue_.front().at_ns; }
  OnItsWay take();
  bool hasMore() const { return !queue_.empty(); }
  /// Returns whether another picture with the id of one that was taken had begun to come when that one was whole.
  bool comesTwice(const OnItsWay& taken) const;

  /// Returns how long it takes to answer a question; kNever: it does not.
  std::int64_t answersAfter_ns() const;
  /// Returns when it stopped answering and sending; kNever: it has not.
  std::int64_t goneSince_ns() const { return ongoing_.lasts(Event::kGone) ? goneSince_ns_ : kNever; }
  bool isHeld() const { return ongoing_.lasts(Event::kHeld); }
  /// Returns for how long another client holds it from now on.
  std::int64_t heldFor_ns() const { return isHeld() ? ongoing_.until_ns(Event::kHeld) - now() : 0; }
  /// Returns for how long it sends nothing from now on, although it answers.
  std::int64_t silentFor_ns() const {
    return ongoing_.lasts(Event::kSilence) ? ongoing_.until_ns(Event::kSilence) - now() : 0;
  }
  /// Returns how long a library hangs that opens it now.
  std::int64_t hangsFor_ns() const {
    return ongoing_.lasts(Event::kHangs) ? ongoing_.until_ns(Event::kHangs) - now() : 0;
  }

  const capture::PictureShape& shape() const { return shape_; }

 private:
  OnItsWay picture();
  void takePicture();
  void send(const OnItsWay& one);

  const Gel& gel_;
  const Ongoing& ongoing_;
  Chance& chance_;
  capture::PictureShape shape_;
  std::int64_t streamsFrom_ns_ = kNever, connectedFrom_ns_ = kNever;
  std::int64_t nextPicture_ns_, clockAhead_ns_ = -500 * kSecond;
  std::uint64_t id_ = 0, pictures_ = 0, taken_ = 0;
  bool hasOtherPictures_ = false;
  std::deque<OnItsWay> queue_;
  std::int64_t goneSince_ns_ = 0;
};

}  // namespace tractiond::simulation
