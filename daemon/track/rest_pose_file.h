// The file of a rest pose in the state directory, so that a load on the gel survives a restart.
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

std::filesystem::path restPosePath(const std::filesystem::path& stateDirectory);

/// Returns the path of the previous zero.
std::filesystem::path earlierPosePath(const std::filesystem::path& stateDirectory);

/// Returns the hash of what a rest pose belongs to: the marker layers, the size of the picture, and kind (mosaic, grey
/// ...) and bits of its format.
Id restPoseOwner(const sensor::Sensor& sensor, PixelFormat format);

/// Reads a rest pose; nothing if there is no file. Fails (EX_DATAERR, EX_NOINPUT) if the file cannot be read, is
/// truncated or damaged, or belongs to another version, sensor, picture or camera: then a new zero must be taken.
/// \param camera its name, at most 4096 bytes
tl::expected<std::optional<RestPose>, Error> loadRestPose(const std::filesystem::path& path,
                                                          const sensor::Sensor& sensor, PixelFormat format,
                                                          const std::string& camera);

/// Writes a rest pose atomically; it is on the disk when the function returns. Creates the directory if it is missing.
/// Fails with EX_CANTCREAT.
tl::expected<void, Error> saveRestPose(const std::filesystem::path& path, const RestPose& pose,
                                       const sensor::Sensor& sensor, PixelFormat format, const std::string& camera);

}  // namespace tractiond::track
