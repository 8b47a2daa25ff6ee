// Commands of `tractiond` that print something about cameras. All return an exit code of sysexits.h.
#pragma once

#include "daemon/capture/camera_options.h"

#include <string>

namespace tractiond {

/// Prints the cameras that are found with warnings about them and, for each that cannot be opened, why. Opens each of
/// them for a moment, which takes seconds. Returns EX_OK, also if no camera is found, which standard error then says.
/// \param options only `inspector` and `fakeInterface` are used
int listCameras(const capture::CameraOptions& options);

/// Prints how a camera would be set, from a file with its GenICam description. A damaged description can crash this
/// process. Returns EX_OK, or after an error on standard error EX_NOINPUT (the file cannot be opened), EX_DATAERR (it
/// is not a description) or EX_CONFIG (the camera would refuse a setting).
/// \param options the settings to make
int planCamera(const std::string& file, const capture::CameraOptions& options);

/// Runs this program again as a child process with the same arguments and --limited: it limits itself (limitChild())
/// and calls planCamera(). Prints its output when it has ended, after 10 s at most. Returns its exit code; EX_DATAERR,
/// with an error on standard error, if it crashes, exceeds a limit, or cannot be started.
/// \param argc, argv those of this process
/// \param file for the error
int planCameraInChild(int argc, char** argv, const std::string& file);

}  // namespace tractiond
