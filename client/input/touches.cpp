#include "client/input/touches.h"

#include "touch/field.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace traction::input {
namespace {

using std::numbers::pi;

/// Time after which a touch is lifted of which nothing is known.
constexpr double kLost_s = 0.1;

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

double stepOf(std::int64_t before_ns, std::int64_t now_ns) {
  return std::clamp(touch::seconds(before_ns, now_ns), 0.0, 0.1);
}

const Touches& View::take(const std::vector<touch::Contact>& contacts, const Field* field, std::int64_t time_ns,
                          const Grid* nodes) {
  touches_.time_ns = time_ns;
  touches_.valid = field != nullptr && field->valid;
  const std::vector<Touch> before = std::exchange(touches_.touches, {});
  for (const touch::Contact& contact : contacts) {
    // A contact may last though nothing is known of it, but nothing stays pressed by what is not known.
    const bool isLost = contact.phase == ContactPhase::kUnknown && touch::seconds(contact.seen_ns, time_ns) > kLost_s;
    const auto known =
        std::find_if(before.begin(), before.end(), [&](const Touch& one) { return one.id == contact.id; });
    const bool seen = contact.phase == ContactPhase::kBegin || contact.phase == ContactPhase::kMove;
    // What was lifted as lost touches again when it is seen.
    if (contact.phase == ContactPhase::kEnd || isLost || (!seen && known == before.end())) continue;
    touches_.touches.push_back(seen ? turned(contact) : *known);
    touches_.touches.back().seen = seen;
  }
  if (touches_.touches.empty()) {
    touches_.wrench = {};
    touches_.gradient = {};
  } else if (touches_.valid) {
    const std::array<double, 3> force = input::turned(field->resultant_N, turn_rad_);
    const std::array<double, 3> moment = input::turned(field->moment_Nm, turn_rad_);
    touches_.wrench = {force[0], force[1], force[2], moment[0], moment[1], moment[2]};
    touches_.gradient = nodes != nullptr ? gradientOf(*field, *nodes) : Gradient{};
  }
  return touches_;
}

Gradient View::gradientOf(const Field& field, const Grid& nodes) const {
  struct Node {
    std::array<double, 2> place{}, force{};
    double press = 0.0, deviation = 0.0;
  };
  std::vector<Node> pressed;
  std::array<double, 2> centre{};  // of pressure
  double sum = 0.0;
  for (std::uint32_t i = 0; i < std::min(field.force_N.size(), field.nodeDeviation_N.size()); ++i) {
    const auto& [x, y, press] = field.force_N[i];
    if (!(press > 0.0F)) continue;
    pressed.push_back({.place = input::turned(nodes.position_m(i % nodes.columns, i / nodes.columns), turn_rad_),
                       .force = input::turned(std::array<double, 2>{x, y}, turn_rad_),
                       .press = press,
                       .deviation = std::max(field.nodeDeviation_N[i][0], field.nodeDeviation_N[i][1])});
    for (const std::size_t k : {0U, 1U}) centre[k] += press * pressed.back().place[k];
    sum += press;
  }

  // Weighted least squares about the centre, where the gradient does not depend on the mean force: forces times places,
  // over places times places.
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (Node& node : pressed) {
    for (const std::size_t k : {0U, 1U}) node.place[k] -= centre[k] / sum;
    xx += node.press * node.place[0] * node.place[0];
    xy += node.press * node.place[0] * node.place[1];
    yy += node.press * node.place[1] * node.place[1];
  }
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 1e-6 * xx * yy)) return {};  // nodes in a line, or none
  std::array<std::array<double, 2>, 2> growth{};   // of a component along an axis [Pa/m]
  double variance = 0.0;
  for (const Node& node : pressed) {
    const double scale = node.press / (determinant * nodes.pitch_m * nodes.pitch_m);
    const auto [x, y] = node.place;
    const std::array weights = {scale * (yy * x - xy * y), scale * (xx * y - xy * x)};
    for (const std::size_t of : {0U, 1U})
      for (const std::size_t along : {0U, 1U}) growth[of][along] += node.force[of] * weights[along];
    variance += node.deviation * node.deviation * (weights[0] * weights[0] + weights[1] * weights[1]);
  }
  return {.dilation_Pa_m = growth[0][0] + growth[1][1],
          .stretch_Pa_m = growth[0][0] - growth[1][1],
          .shear_Pa_m = growth[0][1] + growth[1][0],
          .deviation_Pa_m = std::sqrt(variance)};
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
