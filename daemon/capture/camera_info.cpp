#include "daemon/capture/camera_info.h"

#include <array>
#include <cstdio>

namespace tractiond::capture {

std::string CameraInfo::waits() const {
  if (!triggered) return {};
  return "it waits for triggers (" + (trigger.empty() ? "a trigger is on" : trigger) +
         "): tractionctl trigger sends one, camera.trigger = \"off\" ends it";
}

std::string CameraInfo::summary() const {
  std::array<char, 64> rate{};
  if (frameRate_Hz > 0) std::snprintf(rate.data(), rate.size(), ", %.4g frames/s", frameRate_Hz);
  std::string line = "camera " + name.id + ": " + std::to_string(shape.width) + " x " + std::to_string(shape.height) +
                     " " + std::string(traitsOf(format).name) + rate.data() + (triggered ? ", on trigger" : "");
  if (packetSize_bytes > 0)
    line += ", packets of " + std::to_string(packetSize_bytes) + " bytes" +
            (packetSizeVerified ? "" : " (no frame seen yet)") + ", receive buffer " +
            std::to_string(receiveBuffer_bytes) + " bytes";
  return line;
}

}  // namespace tractiond::capture
