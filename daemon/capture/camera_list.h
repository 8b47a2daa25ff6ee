// Lists the cameras that answer, and what prevents each from being opened.
#pragma once

#include "daemon/capture/camera_info.h"

#include <filesystem>
#include <string>
#include <vector>

namespace tractiond::capture {

/// Returns all cameras that answer; empty: none does. Blocks for about a second.
/// \param withFake puts Aravis's in-process test camera first; false hides it from this whole process
std::vector<CameraName> listCameras(bool withFake = false);

/// What to check where no camera answers.
constexpr const char* kWhatToCheck =
    "see that it has power and a link light, that an interface of this host has an address in its network, and that no "
    "firewall drops UDP port 3956";

struct CameraSight {
  CameraName name;
  std::string obstacle;            ///< why it cannot be opened; empty: it can
  std::string remedy;              ///< for the obstacle
  std::vector<std::string> notes;  ///< warnings, one sentence each
};

/// Returns the cameras of listCameras() and closedUsbCameras(). Opens each for a moment to find its obstacle. Notes
/// shareAdvice() for network cameras at one interface. Blocks for seconds.
/// \param inspector CameraOptions::inspector
/// \param withFake as for listCameras()
std::vector<CameraSight> inspectCameras(const std::string& inspector, bool withFake);

/// Returns the USB3 Vision cameras in the kernel's tables that this process may not open, or that are not among
/// `listed` by their serial number, each with obstacle and remedy.
/// \param sys other than /sys,
/// \param dev other than /dev in tests
std::vector<CameraSight> closedUsbCameras(const std::vector<CameraSight>& listed,
                                          const std::filesystem::path& sys = "/sys",
                                          const std::filesystem::path& dev = "/dev");

/// Describes how several cameras can share a link, with the keys of the configuration to set: each camera's equal part
/// of 90 % of the rate, or the delay after a packet in which each of the others can send one. Returns an empty text for
/// fewer than two cameras, or if the rate of the link is 0 (not known).
/// \param packet_bytes size of a packet with headers
std::string shareAdvice(int cameras, double link_bytes_per_s, int packet_bytes);

}  // namespace tractiond::capture
