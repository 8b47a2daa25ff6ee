// What a camera is called, and what was agreed upon with it.
#pragma once

#include "daemon/records/frame.h"

#include <string>
#include <vector>

namespace tractiond::capture {

/// A camera as Aravis sees it.
struct CameraName {
  std::string id, physicalId, address, vendor, model, serial, protocol;
};

/// All cameras in sight; looks for about a second. `withFake` includes Aravis's in-process test camera.
std::vector<CameraName> listCameras(bool withFake = false);

struct CameraInfo {
  CameraName name;
  int width = 0, height = 0;  ///< px
  PixelFormat format = PixelFormat::kRgb8;
  double frameRate_Hz = 0.0;          ///< 0: the camera does not tell
  double exposure_s = 0.0;            ///< 0: the camera does not tell
  int packetSize_bytes = 0;           ///< with headers; 0: not a network camera
  bool packetSizeVerified = false;    ///< a whole frame has arrived with it
  bool packetSocket = false;          ///< frames are read from a packet socket instead of the normal one
  int receiveBuffer_bytes = 0;        ///< as the kernel granted it; 0: there is none
  std::vector<std::string> settings;  ///< in the order they were made, as read back: "Name = value"
  std::vector<std::string> warnings;  ///< one line each, with the remedy
};

}  // namespace tractiond::capture
