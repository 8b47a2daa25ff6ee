#include "client/input/presses.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace traction::input {

std::optional<Press> Presses::move(const Touch& touch, std::int64_t time_ns) {
  if (!std::exchange(isTouched_, true)) {
    from_m_ = touch.position_m;
    begin_ns_ = time_ns;
    hardest_N_ = 0.0;
    hasMoved_ = hasTurned_ = isTurned_ = false;
  }
  last_ns_ = time_ns;
  hardest_N_ = std::max(hardest_N_, touch.press_N);
  const auto [x, y] = touch.position_m;
  hasMoved_ = hasMoved_ || std::hypot(x - from_m_[0], y - from_m_[1]) >= leastExtent_m_;
  const double torque_Nm = std::abs(touch.torque_Nm);
  if (torque_Nm < 0.5 * options_.turn_Nm) isTurned_ = false;
  if (isTurned_ || torque_Nm < options_.turn_Nm || (hasMoved_ && !hasTurned_)) return std::nullopt;
  isTurned_ = hasTurned_ = true;
  return touch.torque_Nm > 0.0 ? Press::kTurnLeft : Press::kTurnRight;  // from x towards y
}

std::optional<Press> Presses::end() {
  const bool isShort = last_ns_ - begin_ns_ <= options_.most_ns;
  if (!std::exchange(isTouched_, false) || hasTurned_ || !isShort || hardest_N_ < options_.tap_N) return std::nullopt;
  return hardest_N_ < options_.hardPress_N ? Press::kTap : Press::kHard;
}

}  // namespace traction::input
