// The gel file of a configuration: read, described, and kept in recordings.
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

/// Returns the gel file's sensor, the paper's where the name is empty. Fails also for one that cannot be tracked, and
/// for kNoGelFile.
tl::expected<sensor::Sensor, Error> loadSensor(const std::string& gelFile);

/// The same; empty for kNoGelFile.
tl::expected<std::optional<sensor::Sensor>, Error> loadGel(const std::string& gelFile);

/// Sets what a description says of sensor and solver.
void describeSensor(publish::Description& description, const sensor::Sensor& sensor, const solve::SolveOptions& solve);

/// Copies the gel file and the influence file that it names, as they are on the disk. Empty: the built-in gel, or the
/// file has gone.
void readGelFiles(const sensor::Sensor& sensor, const std::string& gelFile, publish::Beginning& beginning);

}  // namespace tractiond
