// Reads the gel file of a configuration, describes it, and copies it into recordings.
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

/// Returns the gel file's sensor; the built-in one for an empty name. Fails also for a sensor that cannot be tracked,
/// and for kNoGelFile.
tl::expected<sensor::Sensor, Error> loadSensor(const std::string& gelFile);

/// Does the same, but returns nothing for kNoGelFile.
tl::expected<std::optional<sensor::Sensor>, Error> loadGel(const std::string& gelFile);

/// Sets sensor and solver in a description.
void describeSensor(publish::Description& description, const sensor::Sensor& sensor, const solve::SolveOptions& solve);

/// Copies the gel file and the influence file that it names, as they are on the disk. Empty: the built-in gel, or the
/// file has gone.
void readGelFiles(const sensor::Sensor& sensor, const std::string& gelFile, publish::Beginning& beginning);

}  // namespace tractiond
