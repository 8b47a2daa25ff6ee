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

Motions motionsOf(const Touches& touches, const Motions& before, const Area& area, double fullPress_N) {
  constexpr double kMemory_s = 0.05;
  Motions motions;
  for (const Touch& touch : touches.touches) {
    const auto known = before.find(touch.id);
    Motion& now = motions[touch.id];
    if (known != before.end()) now = known->second;
    if (!touch.seen) continue;
    const Motion then = now;
    now.time_ns = touches.time_ns;
    now.velocity = {touch.velocity_m_s[0] / area.size_m[0], -touch.velocity_m_s[1] / area.size_m[1]};
    now.press = std::clamp(touch.press_N / fullPress_N, 0.0, 1.0);
    const double dt = then.time_ns != 0 ? stepOf(then.time_ns, now.time_ns) : 0.0;
    if (!(dt > 0.0)) continue;
    const auto follow = [&](double& rate, double change) { rate += (change / dt - rate) * dt / (dt + kMemory_s); };
    follow(now.acceleration,
           std::hypot(now.velocity[0], now.velocity[1]) - std::hypot(then.velocity[0], then.velocity[1]));
    follow(now.pressSpeed, now.press - then.press);
    follow(now.pressAcceleration, now.pressSpeed - then.pressSpeed);
  }
  return motions;
}

std::vector<OscMessage> tuio11(const Touches& touches, const Motions& motions, const Area& area, std::int32_t frame) {
  constexpr const char* kProfile = "/tuio/2Dcur";
  std::vector<OscMessage> messages;
  messages.push_back(OscMessage(kProfile).add("source").add(kSource));
  OscMessage& alive = messages.emplace_back(OscMessage(kProfile).add("alive"));
  for (const Touch& touch : touches.touches) alive.add(static_cast<std::int32_t>(touch.id));
  for (const Touch& touch : touches.touches) {
    const auto [x, y] = area.fractions(touch.position_m);
    const Motion& motion = motions.at(touch.id);
    messages.push_back(OscMessage(kProfile)
                           .add("set")
                           .add(static_cast<std::int32_t>(touch.id))
                           .add({x, y, motion.velocity[0], motion.velocity[1], motion.acceleration}));
  }
  messages.push_back(OscMessage(kProfile).add("fseq").add(frame));
  return messages;
}

std::vector<OscMessage> tuio20(const Touches& touches, const Motions& motions, const Area& area, std::int32_t frame,
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
    const Motion& motion = motions.at(touch.id);
    // How far the force is from the normal, as a finger or a pen that leans.
    const double shear_rad = std::atan2(std::hypot(touch.shear_N[0], touch.shear_N[1]), std::max(touch.press_N, 0.0));
    messages.push_back(OscMessage("/tuio2/ptr")
                           .add(id)
                           .add(0)  // any pointer of any user
                           .add(0)
                           .add({x, y, -touch.orientation_rad, shear_rad, touch.radius_m / area.size_m[1], motion.press,
                                 motion.velocity[0], motion.velocity[1], motion.pressSpeed, motion.acceleration,
                                 motion.pressAcceleration}));
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
  motions_ = motionsOf(touches, motions_, area_, fullPress_N_);
  send(touches, ++frame_);
}

void TuioOutput::turn(std::int64_t now_ns) {
  if (!isTouched_ && now_ns - told_ns_ < kRepeat_ns) return;
  told_ns_ = now_ns;
  // Version 2.0 has frame 0 for what is repeated, but not all receivers take it (tuio-client 0.1.0).
  if (!isTouched_) send({}, version_ == Version::k11 ? -1 : ++frame_);
}

void TuioOutput::send(const Touches& touches, std::int32_t frame) const {
  datagrams_.send(bundleOf(version_ == Version::k11 ? tuio11(touches, motions_, area_, frame)
                                                    : tuio20(touches, motions_, area_, frame, tractiond::realNow())));
}

}  // namespace traction::input
