// What `tractiond` prints about cameras. All return an exit code.
#pragma once

#include "daemon/capture/camera_options.h"

#include <string>

namespace tractiond {

/// Prints the cameras that are found, and why one cannot be opened.
int listCameras(const capture::CameraOptions& options);

/// Prints how a camera would be set, from a file with its GenICam description. A description can end the process that
/// evaluates it.
int planCamera(const std::string& file, const capture::CameraOptions& options);

/// The same in a child process with limits, which is started with these arguments.
int planCameraInChild(int argc, char** argv, const std::string& file);

}  // namespace tractiond
