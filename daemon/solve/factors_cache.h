// Gets the factors of a sensor: from the state directory, or by computing for seconds.
//
// A cache file is a pure function of the sensor and the options, so it may be deleted at any time. It is named after
// the id; the newest four are kept, so that going back to an earlier gel or model starts fast.
#pragma once

#include "daemon/solve/factors.h"

#include <filesystem>
#include <functional>
#include <string>

namespace tractiond::solve {

/// Returns the hash of everything that the numbers of the factors depend on: gel or body, marker and node positions,
/// camera geometry, their uncertainty, mechanics, noise and the version of the algorithms. It is the id of the
/// calibration, and names the cache file.
Id calibrationId(const sensor::Sensor& sensor, const SolveOptions& options);

/// Called on the calling thread, with a line for the log without a line end: why a cache file was not used, what could
/// not be written, what was deleted.
using Remark = std::function<void(const std::string&)>;

/// Returns the factors of the sensor's makeAtoms(): those of the cache file if it is whole and has the right id; else
/// computes and caches them. If the state directory cannot be read or written, it calls `remark` and computes. Creates
/// the directory. After a save it deletes, in the directory, all but the newest cache files, and unfinished ones; so no
/// other process may save there at the same time. Fails as computeFactors().
/// \param atoms makeAtoms(sensor)
/// \param steps called for kInfluence to kSystematicErrors; not called if the cache is used
tl::expected<Factors, Error> loadOrComputeFactors(const sensor::Sensor& sensor, const Atoms& atoms,
                                                  const SolveOptions& options,
                                                  const std::filesystem::path& stateDirectory, const Steps& steps = {},
                                                  const Remark& remark = {});

/// Returns the path of a cache file in the state directory: ID.factors, with the id in hexadecimal digits. Does not
/// access the disk.
std::filesystem::path cachePath(const std::filesystem::path& directory, const Id& id);

}  // namespace tractiond::solve
