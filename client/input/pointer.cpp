#include "client/input/pointer.h"

#include <algorithm>
#include <cmath>

namespace traction::input {

PointerStep Pointer::step(const Touches& touches) {
  PointerStep step;
  const auto seen =
      std::find_if(touches.touches.begin(), touches.touches.end(), [](const Touch& one) { return one.seen; });
  if (touches.touches.empty()) {
    id_ = 0;
    // It was not lifted, for which a field without it comes first: it is lost, or of another device from here on.
    if (state_ == State::kUndecided) state_ = State::kUp;
  }
  if (seen == touches.touches.end()) {
    // A valid field without the contact means that it was lifted; otherwise nothing is known.
    if (touches.valid || touches.touches.empty()) press(0.0, touches.time_ns, step);
    return step;
  }
  if (seen->id == id_) {
    const double size_N = std::hypot(seen->shear_N[0], seen->shear_N[1]);
    const double dt = stepOf(moved_ns_, touches.time_ns);
    const double counts_N =
        size_N > options_.deadZone_N ? options_.speed_N * dt * (size_N - options_.deadZone_N) / size_N : 0.0;
    const auto whole = [&](double& rest, double counts) {
      rest += counts;
      const double sent = std::trunc(rest);
      rest -= sent;
      return static_cast<int>(sent);
    };
    step.right = whole(rest_[0], counts_N * seen->shear_N[0]);
    step.down = whole(rest_[1], -counts_N * seen->shear_N[1]);
  } else {
    id_ = seen->id;
    rest_ = {};
  }
  moved_ns_ = touches.time_ns;
  press(seen->press_N, touches.time_ns, step);
  return step;
}

void Pointer::press(double press_N, std::int64_t time_ns, PointerStep& step) {
  using Button = PointerStep::Button;
  if (state_ == State::kUp && press_N >= options_.press_N) {
    state_ = State::kUndecided;
    pressed_ns_ = time_ns;
  }
  const bool released = press_N < options_.release_N;
  if (state_ == State::kUndecided) {
    if (press_N >= options_.hardPress_N) {
      state_ = State::kSecond;
    } else if (released || time_ns - pressed_ns_ >= options_.decision_ns) {
      state_ = State::kFirst;
    }
    if (state_ != State::kUndecided)
      step.changes.push_back({state_ == State::kFirst ? Button::kFirst : Button::kSecond, true});
  }
  if (released && (state_ == State::kFirst || state_ == State::kSecond)) {
    step.changes.push_back({state_ == State::kFirst ? Button::kFirst : Button::kSecond, false});
    state_ = State::kUp;
  }
}

}  // namespace traction::input
