// Touches as events of input devices: a mouse, a touch screen (multitouch protocol B), a pen and a wheel
// that zooms. Each class has ability(), which returns what its device must be able to do, for EventDevice::make(); and
// write() of Output, which sends the events of one field.
#pragma once

#include "client/input/affine.h"
#include "client/input/events.h"
#include "client/input/pointer.h"
#include "client/input/touches.h"
#include "client/input/tuio.h"

#include <array>
#include <cstdint>
#include <utility>

namespace traction::input {

/// Moves a mouse and clicks by the touch that began first (Pointer).
class PointerDevice : public Output {
 public:
  static EventDevice::Ability ability();
  PointerDevice(EventDevice device, const PointerOptions& options)
      : device_(std::move(device))
      , pointer_(options) {}

  void write(const Touches& touches) override;

 private:
  EventDevice device_;
  Pointer pointer_;
};

struct TouchOptions {
  double fullPress_N = 20.0;  ///< largest press that is reported
};

/// Reports up to 10 touches to a touch screen; further ones are not reported. Pressure is in grams, with resolution 1;
/// places and sizes are in hundredths of a millimetre, from the upper left corner of the area.
class TouchDevice : public Output {
 public:
  static EventDevice::Ability ability(const Area& area, const TouchOptions& options);
  TouchDevice(EventDevice device, const Area& area, const TouchOptions& options)
      : device_(std::move(device))
      , area_(area)
      , options_(options) {}

  void write(const Touches& touches) override;

 private:
  void describe(const Touch& touch);

  static constexpr std::size_t kSlots = 10;

  EventDevice device_;
  Area area_;
  TouchOptions options_;
  std::array<std::uint64_t, kSlots> slots_{};  ///< ids of touches; 0: the slot is free
  std::uint64_t first_ = 0;                    ///< the touch that programs without multitouch follow; 0: none
  bool isTouched_ = false;
};

struct PenOptions {
  double fullPress_N = 10.0;  ///< press that is reported as the largest
};

/// Reports the touch that began first as a pen, until it is lifted. The pen's axis is along the force: shear to the
/// left makes it lean to the right. It is in range only while it touches.
class PenDevice : public Output {
 public:
  static EventDevice::Ability ability(const Area& area);
  PenDevice(EventDevice device, const Area& area, const PenOptions& options)
      : device_(std::move(device))
      , area_(area)
      , options_(options) {}

  void write(const Touches& touches) override;

 private:
  void touch(bool isDown);

  EventDevice device_;
  Area area_;
  PenOptions options_;
  std::uint64_t id_ = 0;  ///< of the touch that is the pen; 0: none
};

/// Turns a wheel while it holds the key Ctrl, by which programs zoom (Zoom).
class ZoomDevice : public Output {
 public:
  static EventDevice::Ability ability();
  ZoomDevice(EventDevice device, const ZoomOptions& options)
      : device_(std::move(device))
      , zoom_(options) {}

  void write(const Touches& touches) override;

 private:
  EventDevice device_;
  Zoom zoom_;
};

/// Sends a single touch to a pointer, and several touches to a touch screen. From the second touch on, until all are
/// lifted, the touch screen has them all, and the pointer has none.
class OneOrSeveral : public Output {
 public:
  OneOrSeveral(PointerDevice one, TouchDevice several)
      : one_(std::move(one))
      , several_(std::move(several)) {}

  void write(const Touches& touches) override;

 private:
  PointerDevice one_;
  TouchDevice several_;
  bool areSeveral_ = false;
};

}  // namespace traction::input
