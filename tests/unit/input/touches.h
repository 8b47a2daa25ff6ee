// Touches of tests, in the user's frame.
#pragma once

#include "client/input/touches.h"

#include <cstdint>
#include <utility>
#include <vector>

namespace traction::input::test {

inline constexpr std::int64_t kFrame_ns = 16'666'667;

inline Touch touchOf(std::uint64_t id, double x_m, double y_m, double press_N = 2.0) {
  return {.id = id,
          .seen = true,
          .position_m = {x_m, y_m},
          .press_N = press_N,
          .radius_m = 4e-3,
          .halfAxes_m = {5e-3, 3e-3}};
}

/// Returns touches of a valid field.
inline Touches fieldOf(std::vector<Touch> touches, std::int64_t time_ns = kFrame_ns) {
  return {.time_ns = time_ns, .valid = true, .touches = std::move(touches)};
}

}  // namespace traction::input::test
