// One contact as a pointer: shear moves it, press clicks.
#pragma once

#include "client/input/touches.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace traction::input {

struct PointerOptions {
  double deadZone_N = 0.2;  ///< shear that moves nothing: what a finger that rests has, and its tremor
  double speed_N = 400.0;   ///< counts per second, for each newton of shear beyond the dead zone
  double press_N = 1.5;     ///< a harder press holds the first button down
  double hardPress_N = 4.0;
  double release_N = 1.0;  ///< a softer press lets go of either button; the difference is more than tremor
  /// Time in which a press can become a hard one, which is the second button in place of the first. A press that is
  /// released earlier is a click.
  std::int64_t decision_ns = 100'000'000;
};

struct PointerStep {
  enum class Button : std::uint8_t { kFirst, kSecond };
  struct Change {
    Button button = Button::kFirst;
    bool down = false;
  };
  int right = 0, down = 0;      ///< counts
  std::vector<Change> changes;  ///< in this order; each button that goes down goes up once
};

/// Makes a pointer of one touch: of those in a field, the one that began first. Thread-bound.
class Pointer {
 public:
  explicit Pointer(const PointerOptions& options)
      : options_(options) {}

  /// Returns what pointer and buttons do in a field.
  PointerStep step(const Touches& touches);

 private:
  enum class State : std::uint8_t { kUp, kUndecided, kFirst, kSecond };

  void press(double press_N, std::int64_t time_ns, PointerStep& step);

  PointerOptions options_;
  std::uint64_t id_ = 0;          ///< of the touch that moved it last; 0: none
  std::int64_t moved_ns_ = 0;     ///< time of its last field
  std::array<double, 2> rest_{};  ///< counts that are not sent yet, as they are not whole
  State state_ = State::kUp;
  std::int64_t pressed_ns_ = 0;  ///< since when it is kUndecided
};

}  // namespace traction::input
