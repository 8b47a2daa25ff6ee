// Fills the vectors of messages: the same for all programs that encode.
#pragma once

namespace traction {

/// Sets a Vector2 or a Vector3. \param from two or three numbers, by index
void setVector(const auto& from, auto& to) {
  to.set_x(from[0]);
  to.set_y(from[1]);
  if constexpr (requires { to.set_z(from[2]); }) to.set_z(from[2]);
}

}  // namespace traction
