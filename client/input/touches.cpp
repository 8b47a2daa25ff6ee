#include "client/input/touches.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace traction::input {
namespace {

using std::numbers::pi;

/// Turns the gel frame by half a turn about its y, and then by `turn_rad` about the user's z.
std::array<double, 3> turned(const std::array<double, 3>& inGel, double turn_rad) {
  const double x = -inGel[0], y = inGel[1];
  const double cosine = std::cos(turn_rad), sine = std::sin(turn_rad);
  return {cosine * x - sine * y, sine * x + cosine * y, -inGel[2]};
}

std::array<double, 2> turned(const std::array<double, 2>& inGel, double turn_rad) {
  const std::array<double, 3> all = turned({inGel[0], inGel[1], 0.0}, turn_rad);
  return {all[0], all[1]};
}

}  // namespace

const Touches& View::take(const std::vector<touch::Contact>& contacts, const Field* field, std::int64_t time_ns) {
  touches_.time_ns = time_ns;
  touches_.valid = field != nullptr && field->valid;
  const std::vector<Touch> before = std::exchange(touches_.touches, {});
  for (const touch::Contact& contact : contacts) {
    if (contact.phase == touch::Phase::kEnd) continue;
    const auto known =
        std::find_if(before.begin(), before.end(), [&](const Touch& one) { return one.id == contact.id; });
    const bool seen = contact.phase == touch::Phase::kBegin || contact.phase == touch::Phase::kMove;
    touches_.touches.push_back(seen || known == before.end() ? turned(contact) : *known);
    touches_.touches.back().seen = seen;
  }
  if (touches_.touches.empty()) {
    touches_.wrench = {};
  } else if (touches_.valid) {
    const std::array<double, 3> force = input::turned(field->resultant_N, turn_rad_);
    const std::array<double, 3> moment = input::turned(field->moment_Nm, turn_rad_);
    touches_.wrench = {force[0], force[1], force[2], moment[0], moment[1], moment[2]};
  }
  return touches_;
}

Touch View::turned(const touch::Contact& contact) const {
  const std::array<double, 3> force = input::turned(contact.force_N, turn_rad_);
  const double orientation_rad = pi - contact.orientation_rad + turn_rad_;
  return {.id = contact.id,
          .position_m = input::turned(contact.position_m, turn_rad_),
          .velocity_m_s = input::turned(contact.velocity_m_s, turn_rad_),
          .shear_N = {force[0], force[1]},
          .press_N = contact.force_N[2],
          .torque_Nm = -contact.moment_Nm[2],
          .radius_m = contact.radius_m,
          .halfAxes_m = contact.halfAxes_m,
          .orientation_rad = orientation_rad - pi * std::floor(orientation_rad / pi + 0.5)};
}

}  // namespace traction::input
