// Who publishes, and what the numbers mean: the content of the description message.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <optional>
#include <string>

namespace tractiond::publish {

/// Stands in every message.
struct Identity {
  std::string sensor;  ///< name from the config; traction::isValidName
  Id boot{};           ///< of this start of the daemon: randomId()
  Id calibration{};    ///< hash of what the forces rest on
};

struct Description {
  Identity identity;
  std::string softwareVersion;
  Id host{};                             ///< hostId()
  std::optional<sensor::Sensor> sensor;  ///< empty: there is no gel, and nothing is measured

  // As the camera says; empty: not seen yet.
  std::string cameraVendor;
  std::string cameraModel;
  std::string cameraSerial;
  std::string pixelFormat;          ///< GenICam's name, "RGB8"
  int width_px = 0, height_px = 0;  ///< of its picture; 0: not seen yet

  std::string mechanics;       ///< "block", "half-space" or "influence file"
  std::string regularisation;  ///< name of the rule, "tikhonov"
  double strength = 0.0;       ///< its parameter, of the largest singular value of the influence matrix [1]
  bool contactAware = false;
  double noise_px = 0.0;                     ///< of a marker's centre, reckoned with
  double forceScale_N = 0.0;                 ///< least force of a node taken as usual
  std::array<double, 2> detectionLimit_N{};  ///< of a force on a node, along the surface and into it

  std::int64_t calibrated_ns = 0;  ///< CLOCK_REALTIME when what identity.calibration names was made
  std::optional<RestPose> zero;    ///< empty: none yet
};

/// 128 random bits.
Id randomId();

/// The boot id of the kernel; processes that share it share CLOCK_MONOTONIC. All zero where there is no /proc.
Id hostId();

}  // namespace tractiond::publish
