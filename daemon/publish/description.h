// Content of the description message: which daemon publishes, and what its numbers mean.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <optional>
#include <string>

namespace tractiond::publish {

/// Part of every message: states which daemon sends it.
struct Identity {
  std::string sensor;  ///< name from the configuration; valid by traction::isValidName
  Id boot{};           ///< of this start of the daemon: randomId()
  Id calibration{};    ///< hash of what the forces are computed from
};

struct Description {
  Identity identity;
  std::string softwareVersion;
  Id host{};                             ///< hostId()
  std::optional<sensor::Sensor> sensor;  ///< empty: there is no gel, and nothing is measured

  // As the camera reports them; empty: no camera opened yet.
  std::string cameraVendor;
  std::string cameraModel;
  std::string cameraSerial;
  std::string pixelFormat;          ///< GenICam's name, "RGB8"
  int width_px = 0, height_px = 0;  ///< of its picture; 0: no camera opened yet

  std::string mechanics;                     ///< "block", "half-space" or "influence file"
  double noise_px = 0.0;                     ///< standard deviation of a marker's centre that the solver assumes
  std::array<double, 2> detectionLimit_N{};  ///< of a force on a node, along the surface and into it

  std::int64_t calibrated_ns = 0;  ///< CLOCK_REALTIME when the numbers of identity.calibration were made
  std::optional<RestPose> zero;    ///< empty: none yet
};

/// Returns 128 random bits.
Id randomId();

/// Returns the boot id of the kernel; processes that share it share CLOCK_MONOTONIC. All zero without /proc.
Id hostId();

}  // namespace tractiond::publish
