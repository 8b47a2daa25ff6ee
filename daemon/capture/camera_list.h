// Lists the cameras that can be found, and what prevents each from being opened.
#pragma once

#include "daemon/capture/camera_info.h"

#include <filesystem>
#include <string>
#include <vector>

namespace tractiond::capture {

/// Returns all cameras that answer within about a second. \param withFake includes Aravis's in-process test camera
std::vector<CameraName> listCameras(bool withFake = false);

struct CameraSight {
  CameraName name;
  std::string obstacle;            ///< why it cannot be opened; empty: it can
  std::string remedy;              ///< what removes the obstacle
  std::vector<std::string> notes;  ///< other facts for the operator
};

/// Returns the cameras of listCameras(), and USB cameras that may not be opened. Opens each camera for a moment.
/// \param inspector as in CameraOptions
std::vector<CameraSight> inspectCameras(const std::string& inspector, bool withFake);

/// Returns a sentence on how `cameras` share a link of `link_bytes_per_s`, with the configuration keys to set.
std::string shareAdvice(int cameras, double link_bytes_per_s, int packet_bytes);

struct UsbCamera {
  std::string vendor, product, serial;
  std::filesystem::path node;  ///< /dev/bus/usb/001/004
  bool permitted = false;
};
/// Returns the USB3 Vision cameras by their interface class, from the kernel's tables.
/// \param sys normally /sys \param dev normally /dev
std::vector<UsbCamera> usbCameras(const std::filesystem::path& sys = "/sys", const std::filesystem::path& dev = "/dev");

}  // namespace tractiond::capture
