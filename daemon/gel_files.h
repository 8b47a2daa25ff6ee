// Reads the gel file of a configuration, and describes it for messages and recordings.
#pragma once

#include "base/error.h"
#include "daemon/publish/description.h"
#include "daemon/publish/wire_recording.h"
#include "daemon/solve/options.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <optional>
#include <string>

namespace tractiond {

/// Reads the sensor of a gel file; an empty name is the built-in gel. Also fails for a sensor that is not
/// track::trackable(), for a calibrated file that was changed, and for kNoGelFile.
tl::expected<sensor::Sensor, Error> loadSensor(const std::string& gelFile);

/// Does the same as loadSensor(), but returns nothing for kNoGelFile.
tl::expected<std::optional<sensor::Sensor>, Error> loadGel(const std::string& gelFile);

/// Sets the fields of a description that depend on sensor and solver.
void describeSensor(publish::Description& description, const sensor::Sensor& sensor, const solve::SolveOptions& solve);

/// Copies the gel file and the influence file that it names, as they are on the disk, into `beginning`. They stay empty
/// for the built-in gel, and if a file is missing.
void readGelFiles(const sensor::Sensor& sensor, const std::string& gelFile, publish::Beginning& beginning);

}  // namespace tractiond
