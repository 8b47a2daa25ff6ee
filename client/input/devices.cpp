#include "client/input/devices.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace traction::input {
namespace {

using std::numbers::pi;

constexpr int kUnits_mm = 100;
constexpr int kMostId = 65'535, kMostPenPress = 4'095, kMostTilt_deg = 60, kTilt_rad = 57;
constexpr double kGram_N = 9.80665e-3;

int unitsOf(double length_m) {
  return static_cast<int>(std::lround(1e3 * kUnits_mm * length_m));
}

/// Returns a place in units from the upper left corner.
std::array<int, 2> placeOf(const Touch& touch, const Area& area) {
  const std::array<double, 2> at = area.fractions(touch.position_m);
  return {unitsOf(at[0] * area.size_m[0]), unitsOf(at[1] * area.size_m[1])};
}

int gramsOf(double force_N) {
  return static_cast<int>(std::lround(force_N / kGram_N));
}

EventDevice::Axis placeAxis(std::uint16_t code, double size_m) {
  return {code, 0, unitsOf(size_m), kUnits_mm};
}

}  // namespace

EventDevice::Ability PointerDevice::ability() {
  return {.name = "traction-input mouse",
          .keys = {BTN_LEFT, BTN_RIGHT},
          .relative = {REL_X, REL_Y},
          .properties = {INPUT_PROP_POINTER},
          .absolute = {}};
}

void PointerDevice::write(const Touches& touches) {
  const PointerStep step = pointer_.step(touches);
  if (step.right != 0) device_.add(EV_REL, REL_X, step.right);
  if (step.down != 0) device_.add(EV_REL, REL_Y, step.down);
  device_.report();
  for (const PointerStep::Change& change : step.changes) {
    device_.add(EV_KEY, change.button == PointerStep::Button::kFirst ? BTN_LEFT : BTN_RIGHT, change.down ? 1 : 0);
    device_.report();
  }
}

EventDevice::Ability TouchDevice::ability(const Area& area, const TouchOptions& options) {
  const int largest = unitsOf(std::max(area.size_m[0], area.size_m[1]));
  return {.name = "traction-input touch",
          .keys = {BTN_TOUCH},
          .relative = {},
          .properties = {INPUT_PROP_DIRECT},
          .absolute = {placeAxis(ABS_X, area.size_m[0]),
                       placeAxis(ABS_Y, area.size_m[1]),
                       {ABS_MT_SLOT, 0, static_cast<int>(kSlots) - 1, 0},
                       {ABS_MT_TRACKING_ID, 0, kMostId, 0},
                       placeAxis(ABS_MT_POSITION_X, area.size_m[0]),
                       placeAxis(ABS_MT_POSITION_Y, area.size_m[1]),
                       {ABS_MT_PRESSURE, 0, gramsOf(options.fullPress_N), 1},
                       {ABS_MT_TOUCH_MAJOR, 0, largest, kUnits_mm},
                       {ABS_MT_TOUCH_MINOR, 0, largest, kUnits_mm},
                       {ABS_MT_ORIENTATION, -90, 90, 0}}};
}

void TouchDevice::write(const Touches& touches) {
  const auto find = [&](std::uint64_t id) {
    return std::find_if(touches.touches.begin(), touches.touches.end(), [&](const Touch& one) { return one.id == id; });
  };
  const auto select = [&](std::size_t slot) { device_.add(EV_ABS, ABS_MT_SLOT, static_cast<int>(slot)); };
  for (std::size_t slot = 0; slot < kSlots; ++slot) {
    if (slots_[slot] == 0 || find(slots_[slot]) != touches.touches.end()) continue;
    select(slot);
    device_.add(EV_ABS, ABS_MT_TRACKING_ID, -1);
    slots_[slot] = 0;
  }
  for (const Touch& touch : touches.touches) {
    auto slot = std::find(slots_.begin(), slots_.end(), touch.id);
    const bool begins = slot == slots_.end();
    if (begins) slot = std::find(slots_.begin(), slots_.end(), 0);
    if (slot == slots_.end() || !touch.seen) continue;
    select(static_cast<std::size_t>(slot - slots_.begin()));
    if (begins) device_.add(EV_ABS, ABS_MT_TRACKING_ID, static_cast<int>(touch.id % (kMostId + 1)));
    *slot = touch.id;
    describe(touch);
  }
  if (find(first_) == touches.touches.end()) first_ = touches.touches.empty() ? 0 : touches.touches.front().id;
  if (const auto first = find(first_); first != touches.touches.end() && first->seen) {
    const auto [x, y] = placeOf(*first, area_);
    device_.add(EV_ABS, ABS_X, x);
    device_.add(EV_ABS, ABS_Y, y);
  }
  const bool isTouched = std::any_of(slots_.begin(), slots_.end(), [](std::uint64_t id) { return id != 0; });
  if (isTouched != std::exchange(isTouched_, isTouched)) device_.add(EV_KEY, BTN_TOUCH, isTouched ? 1 : 0);
  device_.report();
}

void TouchDevice::describe(const Touch& touch) {
  const auto [x, y] = placeOf(touch, area_);
  const int largest = unitsOf(std::max(area_.size_m[0], area_.size_m[1]));
  device_.add(EV_ABS, ABS_MT_POSITION_X, x);
  device_.add(EV_ABS, ABS_MT_POSITION_Y, y);
  device_.add(EV_ABS, ABS_MT_PRESSURE, std::clamp(gramsOf(touch.press_N), 0, gramsOf(options_.fullPress_N)));
  device_.add(EV_ABS, ABS_MT_TOUCH_MAJOR, std::min(unitsOf(2.0 * touch.halfAxes_m[0]), largest));
  device_.add(EV_ABS, ABS_MT_TOUCH_MINOR, std::min(unitsOf(2.0 * touch.halfAxes_m[1]), largest));
  // Clockwise from away.
  const double clockwise_rad =
      touch.orientation_rad < 0.0 ? -pi / 2 - touch.orientation_rad : pi / 2 - touch.orientation_rad;
  device_.add(EV_ABS, ABS_MT_ORIENTATION, static_cast<int>(std::lround(clockwise_rad * 180.0 / pi)));
}

EventDevice::Ability PenDevice::ability(const Area& area) {
  return {.name = "traction-input pen",
          .keys = {BTN_TOOL_PEN, BTN_TOUCH, BTN_STYLUS},
          .relative = {},
          .properties = {INPUT_PROP_POINTER},
          .absolute = {placeAxis(ABS_X, area.size_m[0]),
                       placeAxis(ABS_Y, area.size_m[1]),
                       {ABS_PRESSURE, 0, kMostPenPress, 0},
                       {ABS_TILT_X, -kMostTilt_deg, kMostTilt_deg, kTilt_rad},
                       {ABS_TILT_Y, -kMostTilt_deg, kMostTilt_deg, kTilt_rad}}};
}

void PenDevice::write(const Touches& touches) {
  const auto pen =
      std::find_if(touches.touches.begin(), touches.touches.end(), [&](const Touch& one) { return one.id == id_; });
  if (id_ != 0 && pen == touches.touches.end()) {
    device_.add(EV_ABS, ABS_PRESSURE, 0);
    touch(false);
    device_.report();
    id_ = 0;
  }
  const auto at = id_ != 0 ? pen : touches.touches.begin();
  if (at == touches.touches.end() || !at->seen) return;
  const auto [x, y] = placeOf(*at, area_);
  device_.add(EV_ABS, ABS_X, x);
  device_.add(EV_ABS, ABS_Y, y);
  const double press = std::clamp(at->press_N / options_.fullPress_N, 0.0, 1.0);
  device_.add(EV_ABS, ABS_PRESSURE, std::max(1, static_cast<int>(std::lround(kMostPenPress * press))));
  // A pen that leans to the right pushes to the left; one that leans towards the user pushes away.
  const auto tilt = [&](double shear_N) {
    const double tilt_deg = std::atan2(shear_N, std::max(at->press_N, 0.0)) * 180.0 / pi;
    return std::clamp(static_cast<int>(std::lround(tilt_deg)), -kMostTilt_deg, kMostTilt_deg);
  };
  device_.add(EV_ABS, ABS_TILT_X, tilt(-at->shear_N[0]));
  device_.add(EV_ABS, ABS_TILT_Y, tilt(at->shear_N[1]));
  if (id_ == 0) touch(true);
  id_ = at->id;
  device_.report();
}

void PenDevice::touch(bool isDown) {
  device_.add(EV_KEY, BTN_TOOL_PEN, isDown ? 1 : 0);
  device_.add(EV_KEY, BTN_TOUCH, isDown ? 1 : 0);
}

EventDevice::Ability ZoomDevice::ability() {
  return {.name = "traction-input zoom",
          .keys = {KEY_LEFTCTRL, BTN_LEFT},  // without a button and axes it is no mouse
          .relative = {REL_X, REL_Y, REL_WHEEL, REL_WHEEL_HI_RES},
          .properties = {INPUT_PROP_POINTER},
          .absolute = {}};
}

void ZoomDevice::write(const Touches& touches) {
  constexpr int kNotch = 120;
  const int notches = zoom_.step(touches);
  if (notches == 0) return;
  device_.add(EV_KEY, KEY_LEFTCTRL, 1);
  device_.report();
  device_.add(EV_REL, REL_WHEEL, notches);
  device_.add(EV_REL, REL_WHEEL_HI_RES, kNotch * notches);
  device_.report();
  device_.add(EV_KEY, KEY_LEFTCTRL, 0);
  device_.report();
}

void OneOrSeveral::write(const Touches& touches) {
  if (touches.touches.empty()) areSeveral_ = false;
  if (touches.touches.size() > 1) areSeveral_ = true;
  Touches none = touches;
  none.touches.clear();
  one_.write(areSeveral_ ? none : touches);
  several_.write(areSeveral_ ? touches : none);
}

}  // namespace traction::input
