// Keeps the rest pose in the state directory, so that after a restart the forces are still those of the same load.
#pragma once

#include "base/error.h"
#include "daemon/records/frame.h"
#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace tractiond::track {

/// Returns the path of the file of the zero in force, which need not exist.
std::filesystem::path restPosePath(const std::filesystem::path& stateDirectory);

/// Returns the path of the file of the zero that was in force before, which need not exist.
std::filesystem::path earlierPosePath(const std::filesystem::path& stateDirectory);

/// Returns the hash of what a rest pose belongs to: the marker layers, the size of the picture, and the kind (mosaic,
/// grey, RGB or YUV) and bits of its format.
Id restPoseOwner(const sensor::Sensor& sensor, PixelFormat format);

/// Reads a rest pose; returns nothing, without an error, if there is no file. EX_NOINPUT: the file cannot be read.
/// EX_DATAERR: it is cut short, damaged, of another version, or of another sensor, picture or camera; a new zero is
/// needed then. Of a file of the version before, RestPose::oddity is empty. Waits for the disk.
/// \param camera sensor::MeasuredWith::text(), at most 4096 bytes; a file of before names the camera without the
/// picture
tl::expected<std::optional<RestPose>, Error> loadRestPose(const std::filesystem::path& path,
                                                          const sensor::Sensor& sensor, PixelFormat format,
                                                          const std::string& camera);

/// Writes a rest pose as a whole or not at all, replacing an existing file; it is on the disk when this returns. Waits
/// for the disk. Creates the directory if it is missing. Fails with EX_CANTCREAT.
/// \param camera as for loadRestPose(); the rest of a longer name is cut off, and the file then fits no camera
tl::expected<void, Error> saveRestPose(const std::filesystem::path& path, const RestPose& pose,
                                       const sensor::Sensor& sensor, PixelFormat format, const std::string& camera);

}  // namespace tractiond::track
