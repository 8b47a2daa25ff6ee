// Events of a Linux input device, which the kernel makes of them (uinput).
#pragma once

#include "base/error.h"

#include <linux/input.h>
#include <tl/expected.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace traction::input {

/// Writes events to a device, one report after another.
class EventDevice {
 public:
  struct Axis {
    std::uint16_t code = 0;
    int least = 0, most = 0;
    int resolution = 0;  ///< units per millimetre, per radian, or of a pressure per gram; 0: it has none
  };
  /// What the device can do; codes are those of linux/input-event-codes.h.
  struct Ability {
    std::string name;
    std::vector<std::uint16_t> keys, relative, properties;
    std::vector<Axis> absolute;
  };

  /// Makes a device, which lasts as long as the object. EX_UNAVAILABLE: the kernel has no uinput; EX_NOPERM: no
  /// permission to open it; EX_OSERR: it refuses the device.
  static tl::expected<EventDevice, tractiond::Error> make(const Ability& ability);
  /// Takes a file descriptor to write to.
  explicit EventDevice(int descriptor)
      : descriptor_(descriptor) {}
  ~EventDevice();
  EventDevice(EventDevice&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)) {}

  /// Adds an event to the next report; type and code are those of linux/input-event-codes.h.
  void add(std::uint16_t type, std::uint16_t code, int value);
  /// Writes the events that were added since the last report, if there are any. Logs a warning if they are lost.
  void report();

 private:
  int descriptor_;
  std::vector<input_event> events_;
};

}  // namespace traction::input
