// Names of a camera, and what was agreed upon with it when it was opened.
#pragma once

#include "daemon/records/frame.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace tractiond::capture {

/// A camera's names. Each may be empty: not known.
struct CameraName {
  std::string id;          ///< as Aravis lists it
  std::string physicalId;  ///< MAC address, GUID or device file; in a list of cameras only
  std::string address;     ///< IPv4, of a GigE Vision camera
  std::string vendor, model, serial;
  std::string protocol;  ///< "GigEVision", "USB3Vision" or "Fake"
};

/// Values of the camera when it was opened; none: the camera does not report it, or controls it automatically.
struct Standing {
  std::optional<double> exposure_us, gain, frameRate_Hz;
};

/// What the camera and the driver agreed upon when the stream was opened.
struct PictureShape {
  int width = 0, height = 0;  ///< px
  std::size_t size = 0;       ///< bytes
  std::uint32_t format = 0;   ///< the camera's own code (PFNC)
  bool operator==(const PictureShape&) const = default;
};

struct CameraInfo {
  CameraName name;
  unsigned session = 0;  ///< from 1 on: how often it has been opened; 0 in Driver::info()
  PictureShape shape;
  PixelFormat format = PixelFormat::kRgb8;  ///< of its pictures
  std::string cut;                          ///< what else shapes them, as read: ", OffsetX = 8, ReverseX = true"
  bool zeroIsAnId = false;                  ///< frames are counted from 0, as on USB
  bool triggered = false;                   ///< frames come when they are asked for: silence is no loss
  std::string trigger;                      ///< which triggers are on: "TriggerMode is On for FrameStart"
  double frameRate_Hz = 0.0;                ///< 0: the camera does not tell
  double exposure_s = 0.0;                  ///< 0: the camera does not tell
  int packetSize_bytes = 0;                 ///< with headers; 0: not a network camera
  bool packetSizeVerified = false;          ///< a whole frame has arrived with it
  int receiveBuffer_bytes = 0;              ///< as the kernel granted it; 0: there is none
  std::vector<std::string> settings;        ///< in the order they were made, as read back: "Name = value"
  Standing standing;                        ///< what the configuration left open
  std::vector<std::string> warnings;        ///< one line each, with the remedy

  /// Returns what the camera waits for before it sends a frame, and how to end that; empty unless it is triggered.
  std::string waits() const {
    if (!triggered) return {};
    return "it waits for triggers (" + (trigger.empty() ? "a trigger is on" : trigger) +
           "): tractionctl trigger sends one, camera.trigger = \"off\" ends it";
  }
};

}  // namespace tractiond::capture
