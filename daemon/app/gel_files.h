// Reads the gel file of a configuration, and describes it for messages and recordings. Reentrant.
#pragma once

#include "base/error.h"
#include "daemon/capture/camera_info.h"
#include "daemon/publish/description.h"
#include "daemon/publish/wire_recording.h"
#include "daemon/solve/options.h"
#include "sensor/measured_with.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <filesystem>
#include <optional>
#include <string>

namespace tractiond {

/// Reads the sensor of a gel file, and the influence file that it names; an empty name is the built-in gel. Waits for
/// the disk. EX_NOINPUT: a file cannot be read. EX_DATAERR: the influence file is damaged. EX_CONFIG: the gel file is
/// wrong, the sensor is not track::trackable(), a calibrated file was changed, or the name is kNoGelFile.
tl::expected<sensor::Sensor, Error> loadSensor(const std::string& gelFile);

/// Does the same as loadSensor(), but returns nothing for kNoGelFile.
tl::expected<std::optional<sensor::Sensor>, Error> loadGel(const std::string& gelFile);

/// Returns what is measured with a camera from now on.
sensor::MeasuredWith measuredWith(const capture::CameraInfo& info);

/// Fails with EX_CONFIG if the camera's pictures cannot be those of a sensor: by their size or format, or because its
/// lens, pose or calibration was measured with another camera, or another cut of its picture.
/// \param gelFile names it in the error
tl::expected<void, Error> checkCamera(const sensor::Sensor& sensor, const capture::CameraInfo& info,
                                      const std::string& gelFile);

/// Reads the text of a gel file that is to be put in force. Fails (EX_CONFIG) if it cannot be: it is wrong or names an
/// influence file, its solver would need more memory than the service has, or the checkCamera() of it fails.
tl::expected<sensor::Sensor, Error> readAdopted(const std::string& text, const capture::CameraInfo& info);

/// Lets a child process (`program --inspect-gel FILE`) do the same but checkCamera(): what somebody else wrote may
/// crash or occupy what reads it. Fails with what the child says, or why it could not say anything. Blocks until it has
/// ended, for 10 s at most.
tl::expected<void, Error> checkInChild(const std::filesystem::path& gelFile, const std::string& program);

/// Checks a gel file, and prints what is wrong with it to standard output. For that child process: lowers its limits
/// for good. Returns an exit code; a gel file may end the process instead.
int printGelCheck(const std::string& gelFile);

/// Sets the sensor, its mechanics and the noise of a description, whose identity must be set. Leaves the detection
/// limit and the time of the calibration, which only the solver that was made knows, as they are.
void describeSensor(publish::Description& description, const sensor::Sensor& sensor, const solve::SolveOptions& solve);

/// Copies the gel file and the influence file that it names, as they are on the disk, into `beginning`. Each is set
/// empty if there is none (as for the built-in gel) or it cannot be read, which is an error (EX_NOINPUT): a recording
/// that lacks its gel file is replayed with the built-in gel. Waits for the disk.
/// \param sensor of that gel file
tl::expected<void, Error> readGelFiles(const sensor::Sensor& sensor, const std::string& gelFile,
                                       publish::Beginning& beginning);

/// Returns the sensor of the gel file that a recording holds; the built-in one if it holds none. EX_DATAERR: that file
/// is damaged.
/// \param scratch path at which the influence file of the recording is kept during the call
tl::expected<sensor::Sensor, Error> recordedSensor(const publish::Beginning& beginning, const std::string& recording,
                                                   const std::filesystem::path& scratch);

}  // namespace tractiond
