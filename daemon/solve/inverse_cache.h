// Gets an inverse, or the factors of the model of contacts: from the state directory, or by computing for seconds.
//
// A cache file is a pure function of the sensor and the options, so it may be deleted at any time. It is named after
// the id; the newest four of each kind are kept, so that going back to an earlier gel or model starts fast.
#pragma once

#include "daemon/solve/factors.h"

#include <filesystem>
#include <functional>
#include <string>

namespace tractiond::solve {

/// Returns the hash of everything that the numbers of an inverse depend on: gel or body, marker and node positions,
/// camera geometry, their uncertainty, model, regularisation, truncation, noise and the version of the algorithms. It
/// names the cache file and is the id of the calibration.
Id inverseId(const sensor::Sensor& sensor, const SolveOptions& options);

/// Returns the same for the factors of the model of contacts with modelOptions(options).
Id factorsId(const sensor::Sensor& sensor, const SolveOptions& options);

/// Called on the calling thread, with a line for the log without a line end: why a cache file was not used, what could
/// not be written, what was deleted.
using Remark = std::function<void(const std::string&)>;

/// Returns the cached inverse if its file is whole and has the right id; else computes the inverse and caches it. If
/// the state directory cannot be read or written, it calls `remark` and computes. Creates the directory; deletes older
/// cache files after a save. Fails as computeInverse() if the inverse cannot be computed. `progress` covers the whole
/// computation and is not called if the cache is used.
tl::expected<Inverse, Error> loadOrCompute(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const std::filesystem::path& stateDirectory,
                                           const sensor::elastic::Progress& progress = {}, const Remark& remark = {});

/// Returns the factors of the sensor's makeAtoms() with modelOptions(options), in the same way. Fails as
/// computeFactors(). \param atoms makeAtoms(sensor)
tl::expected<Factors, Error> loadOrComputeFactors(const sensor::Sensor& sensor, const Atoms& atoms,
                                                  const SolveOptions& options,
                                                  const std::filesystem::path& stateDirectory,
                                                  const sensor::elastic::Progress& progress = {},
                                                  const Remark& remark = {});

// Return the path of a cache file in the state directory: of an inverse (ID.inverse), of factors (ID.factors), with the
// id in hexadecimal digits. They do not access the disk.
std::filesystem::path cachePath(const std::filesystem::path& directory, const Id& id);
std::filesystem::path factorsPath(const std::filesystem::path& directory, const Id& id);

}  // namespace tractiond::solve
