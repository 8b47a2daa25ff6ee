#include "client/input/tuio.h"

#include "base/clock.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace traction::input {
namespace {

constexpr std::string_view kSource = "traction-input:0@localhost";

}  // namespace

std::array<double, 2> Area::fractions(const std::array<double, 2>& position_m) const {
  return {std::clamp(0.5 + position_m[0] / size_m[0], 0.0, 1.0), std::clamp(0.5 - position_m[1] / size_m[1], 0.0, 1.0)};
}

std::vector<OscMessage> tuio11(const Touches& touches, const Area& area, std::int32_t frame) {
  constexpr const char* kProfile = "/tuio/2Dcur";
  std::vector<OscMessage> messages;
  messages.push_back(OscMessage(kProfile).add("source").add(kSource));
  OscMessage& alive = messages.emplace_back(OscMessage(kProfile).add("alive"));
  for (const Touch& touch : touches.touches) alive.add(static_cast<std::int32_t>(touch.id));
  for (const Touch& touch : touches.touches) {
    const auto [x, y] = area.fractions(touch.position_m);
    messages.push_back(OscMessage(kProfile)
                           .add("set")
                           .add(static_cast<std::int32_t>(touch.id))
                           .add({x, y, touch.velocity_m_s[0] / area.size_m[0], -touch.velocity_m_s[1] / area.size_m[1],
                                 0.0}));  // the acceleration is not known
  }
  messages.push_back(OscMessage(kProfile).add("fseq").add(frame));
  return messages;
}

std::vector<OscMessage> tuio20(const Touches& touches, const Area& area, double fullPress_N, std::int32_t frame,
                               std::int64_t real_ns) {
  std::vector<OscMessage> messages;
  const auto tenthsOfMm = [](double size_m) { return static_cast<std::int32_t>(std::lround(1e4 * size_m)); };
  messages.push_back(OscMessage("/tuio2/frm")
                         .add(frame)
                         .addTime(real_ns)
                         .add((tenthsOfMm(area.size_m[0]) << 16) | tenthsOfMm(area.size_m[1]))
                         .add(kSource));
  OscMessage alive("/tuio2/alv");
  for (const Touch& touch : touches.touches) {
    const auto id = static_cast<std::int32_t>(touch.id);
    const auto [x, y] = area.fractions(touch.position_m);
    // How far the force is from the normal, as a finger or a pen that leans.
    const double shear_rad = std::atan2(std::hypot(touch.shear_N[0], touch.shear_N[1]), std::max(touch.press_N, 0.0));
    messages.push_back(OscMessage("/tuio2/ptr")
                           .add(id)
                           .add(0)  // any pointer of any user
                           .add(0)
                           .add({x, y, -touch.orientation_rad, shear_rad, touch.radius_m / area.size_m[1],
                                 std::clamp(touch.press_N / fullPress_N, 0.0, 1.0)}));
    alive.add(id);
  }
  messages.push_back(std::move(alive));
  return messages;
}

TuioOutput::TuioOutput(Datagrams datagrams, Version version, const Area& area, double fullPress_N)
    : datagrams_(std::move(datagrams))
    , version_(version)
    , area_(area)
    , fullPress_N_(fullPress_N)
    // Receivers ignore numbers below those of before, also of an earlier start: up to 200 frames/s these are higher.
    , frame_(static_cast<std::int32_t>(tractiond::realNow() / 5'000'000 % INT32_MAX)) {}

void TuioOutput::write(const Touches& touches) {
  if (touches.touches.empty() && !isTouched_) return;
  isTouched_ = !touches.touches.empty();
  ++frame_;
  datagrams_.send(bundleOf(version_ == Version::k11
                               ? tuio11(touches, area_, frame_)
                               : tuio20(touches, area_, fullPress_N_, frame_, tractiond::realNow())));
}

}  // namespace traction::input
