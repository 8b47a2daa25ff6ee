// What one contact says without moving: a tap, a hard press, a turn to the left or to the right.
#pragma once

#include "client/input/touches.h"

#include <array>
#include <cstdint>
#include <optional>

namespace traction::input {

struct PressOptions {
  double tap_N = 0.5;                  ///< a tap is pressed harder
  double hardPress_N = 4.0;            ///< what is pressed harder is a hard press in place of a tap
  std::int64_t most_ns = 400'000'000;  ///< a touch that lasts longer is neither: a finger that rests
  double turn_Nm = 5e-3;               ///< torque that is a turn; another one begins when it was below half of it
};

enum class Press : std::uint8_t { kTap, kHard, kTurnLeft, kTurnRight };

/// Recognises presses and turns of one touch from the fields with it. Thread-bound.
class Presses {
 public:
  /// \param leastExtent_m distance from its begin from which on a touch is a stroke, whose torque is no turn
  Presses(const PressOptions& options, double leastExtent_m)
      : options_(options)
      , leastExtent_m_(leastExtent_m) {}

  /// Takes the touch of a field; the first call after end() or cancel() begins it. Returns the turn that begins in this
  /// field, if any.
  std::optional<Press> move(const Touch& touch, std::int64_t time_ns);
  /// Returns whether the touch has turned: then it is no stroke.
  bool hasTurned() const { return hasTurned_; }
  /// Ends the touch. Returns the tap or hard press that it was; nothing if it was softer than a tap, lasted longer than
  /// PressOptions::most_ns, or has turned, or if there is none. The result has no meaning for a stroke.
  std::optional<Press> end();
  /// Forgets the touch.
  void cancel() { isTouched_ = false; }

 private:
  PressOptions options_;
  double leastExtent_m_;
  bool isTouched_ = false;
  // Of the touch:
  std::array<double, 2> from_m_{};
  std::int64_t begin_ns_ = 0, last_ns_ = 0;
  double hardest_N_ = 0.0;
  bool hasMoved_ = false, hasTurned_ = false;
  bool isTurned_ = false;  ///< and its torque was not below half of a turn since
};

}  // namespace traction::input
