// Where an inverse, or the factors of the model of contacts, come from: the state directory, or seconds of computing.
//
// A cache file is a pure function of the sensor and the options, so it may be deleted at any time. It is named after
// the id; the newest four of each kind are kept, so that going back to an earlier gel or model starts fast.
#pragma once

#include "daemon/solve/factors.h"

#include <filesystem>
#include <functional>
#include <string>

namespace tractiond::solve {

/// The hash of everything an inverse's numbers depend on: gel or body, marker and node positions, camera geometry, how
/// well they are known, model, regularisation, truncation, noise and the version of the algorithms. It is the file's
/// key and the calibration's id.
Id inverseId(const sensor::Sensor& sensor, const SolveOptions& options);

/// The same for the factors of the model of contacts with modelOptions(options).
Id factorsId(const sensor::Sensor& sensor, const SolveOptions& options);

/// One line each for the log: why a cache was not used, what could not be written, what was deleted.
using Remark = std::function<void(const std::string&)>;

/// The cached inverse if it is whole and fits, else a new one, which is then cached. A state directory that cannot be
/// read or written costs time at every start, not the start; it is remarked. Fails if there is no inverse.
tl::expected<Inverse, Error> loadOrCompute(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const std::filesystem::path& stateDirectory,
                                           const sensor::elastic::Progress& progress = {}, const Remark& remark = {});

/// The same for the factors of the sensor's makeAtoms() with modelOptions(options).
tl::expected<Factors, Error> loadOrComputeFactors(const sensor::Sensor& sensor, const Atoms& atoms,
                                                  const SolveOptions& options,
                                                  const std::filesystem::path& stateDirectory,
                                                  const sensor::elastic::Progress& progress = {},
                                                  const Remark& remark = {});

std::filesystem::path cachePath(const std::filesystem::path& directory, const Id& id);
std::filesystem::path factorsPath(const std::filesystem::path& directory, const Id& id);

}  // namespace tractiond::solve
