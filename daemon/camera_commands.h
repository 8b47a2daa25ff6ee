// Commands of `tractiond` that print something about cameras. All return an exit code of sysexits.h.
#pragma once

#include "daemon/capture/camera_options.h"

#include <string>

namespace tractiond {

/// Prints the cameras that are found and, for each that cannot be opened, why. Opens each of them for a moment, which
/// takes seconds. Returns EX_OK, also if no camera is found, which standard error then says.
/// \param options only `inspector` and `fakeInterface` are used
int listCameras(const capture::CameraOptions& options);

/// Prints how a camera would be set, from a file with its GenICam description. A damaged description can crash this
/// process.
int planCamera(const std::string& file, const capture::CameraOptions& options);

/// Runs planCamera() in a child process with limits, and prints its output. \param argc, argv those of this process
int planCameraInChild(int argc, char** argv, const std::string& file);

}  // namespace tractiond
