// Reads and writes the two zeros in the state directory: the one in force, and the one that it replaced.
#pragma once

#include "daemon/track/rest_pose_file.h"

#include <optional>

namespace tractiond::control {

/// The sensor, which must outlive it, the picture format and the camera (sensor::MeasuredWith::text()) that zeros
/// belong to.
struct ZeroOwner {
  const sensor::Sensor& sensor;
  PixelFormat format;
  std::string camera;
};

/// Writes the zero that is replaced, then the new one, and waits until both are on the disk. A loss of power in between
/// leaves the former in both files, and so does an error with the new zero. Fails with EX_CANTCREAT; the new zero is
/// not written if the former cannot be.
/// \param before nullptr: there was none, and its file stays as it is
tl::expected<void, Error> saveZeros(const std::filesystem::path& stateDirectory, const RestPose& zero,
                                    const RestPose* before, const ZeroOwner& owner);

/// Reads the zero that an earlier run has left, if there is one, and synchronises its name: a daemon that was killed
/// while it wrote the zero may not have done so. Waits for the disk. EX_NOINPUT: its file cannot be read. EX_DATAERR:
/// it is damaged, or belongs to another sensor, picture or camera.
tl::expected<std::optional<RestPose>, Error> restoreZero(const std::filesystem::path& stateDirectory,
                                                         const ZeroOwner& owner);

/// Reads the zero that `restored` replaced, for an undo. Returns nothing, without an error, if it is `restored` itself
/// (power was lost while a new zero was written) or if there is no file. If `restored` is empty, returns the file's
/// zero. Waits for the disk. EX_NOINPUT, EX_DATAERR: as restoreZero().
tl::expected<std::optional<RestPose>, Error> loadEarlierZero(const std::filesystem::path& stateDirectory,
                                                             const std::optional<RestPose>& restored,
                                                             const ZeroOwner& owner);

}  // namespace tractiond::control
