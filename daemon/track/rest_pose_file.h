// The rest pose in the state directory: what lets a restart keep the load.
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

/// Of the zero that was in force before.
std::filesystem::path earlierPosePath(const std::filesystem::path& stateDirectory);

/// Hash of what a rest pose belongs to: the marker layers, the size of the picture, and of its format the kind (mosaic,
/// grey ...) and the bits.
Id restPoseOwner(const sensor::Sensor& sensor, PixelFormat format);

/// Nothing where there is no file. Fails (EX_DATAERR, EX_NOINPUT) where the file cannot be read, is cut short, damaged,
/// of another version or of another sensor, picture or camera: then a zero must be taken anew. \param camera its name,
/// at most 4096 bytes.
tl::expected<std::optional<RestPose>, Error> loadRestPose(const std::filesystem::path& path,
                                                          const sensor::Sensor& sensor, PixelFormat format,
                                                          const std::string& camera);

/// All or nothing; on the disk when it returns. Makes the directory if it is missing. Fails with EX_CANTCREAT.
tl::expected<void, Error> saveRestPose(const std::filesystem::path& path, const RestPose& pose,
                                       const sensor::Sensor& sensor, PixelFormat format, const std::string& camera);

}  // namespace tractiond::track
