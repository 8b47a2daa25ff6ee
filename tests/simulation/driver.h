// The driver of the simulated camera. Its calls take effect at once, and add to spent_ns() how long they take.
#pragma once

#include "daemon/capture/camera_options.h"
#include "daemon/capture/driver.h"
#include "tests/simulation/camera.h"

#include <array>
#include <string>

namespace tractiond::simulation {

/// What a life knows of the drivers that its keeper opens. Outlives them.
struct Connection {
  Camera& camera;
  int open = 0, opened = 0;
  capture::CameraOptions options = {};           ///< that the camera was opened with last
  std::string refused = {};                      ///< why it could not be opened; empty: it could, at the last try
  bool isPopped = false;                         ///< the capture stage has the driver
  std::chrono::milliseconds popWaits{100};       ///< as long as the last pop() would have waited
  static constexpr std::size_t kPictures = 256;  ///< more than are in flight
  std::array<Picture, kPictures> pictures{};
  std::size_t nextPicture = 0;
};

/// Returns the simulated driver, opened with `options`; it refuses all features of the camera. `connection` must
/// outlive it.
capture::OpenDriver fromSimulation(Connection& connection, const capture::CameraOptions& options);

}  // namespace tractiond::simulation
