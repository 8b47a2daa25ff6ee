// What cameras are in sight, and what keeps each from being opened.
#pragma once

#include "daemon/capture/camera_info.h"

#include <filesystem>
#include <string>
#include <vector>

namespace tractiond::capture {

/// All cameras that answer; looks for about a second. `withFake` includes Aravis's in-process test camera.
std::vector<CameraName> listCameras(bool withFake = false);

struct CameraSight {
  CameraName name;
  std::string obstacle;            ///< why it cannot be opened; empty: it can
  std::string remedy;              ///< of that
  std::vector<std::string> notes;  ///< what else should be known
};

/// As listCameras, and USB cameras that may not be opened. Opens each for a moment, so that it knows.
/// \param inspector as CameraOptions has it
std::vector<CameraSight> inspectCameras(const std::string& inspector, bool withFake);

/// How `cameras` share a link of `link_bytes_per_s`, in words, with the keys that make them.
std::string shareAdvice(int cameras, double link_bytes_per_s, int packet_bytes);

/// USB3 Vision cameras by their interface class, from the kernel's tables. \param sys normally /sys; \param dev /dev
struct UsbCamera {
  std::string vendor, product, serial;
  std::filesystem::path node;  ///< /dev/bus/usb/001/004
  bool permitted = false;
};
std::vector<UsbCamera> usbCameras(const std::filesystem::path& sys = "/sys", const std::filesystem::path& dev = "/dev");

}  // namespace tractiond::capture
