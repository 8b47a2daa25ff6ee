// Makes the solver of a sensor.
#pragma once

#include "daemon/solve/factors_cache.h"
#include "daemon/solve/field_solver.h"
#include "daemon/solve/rest_places.h"

#include <memory>

namespace tractiond::solve {

struct MadeSolver {
  std::unique_ptr<FieldSolver> solver;  ///< owns all that it needs; never null
  std::int64_t computed_ns = 0;         ///< CLOCK_REALTIME when the numbers it solves with were computed
};

/// Makes the solver. Reads its factors from the state directory, or computes them in seconds and caches them there.
/// Fails if they cannot be computed (EX_CONFIG or EX_SOFTWARE, as loadOrComputeFactors()). The arguments need not
/// outlive the solver.
/// \param steps called for kDetectionLimit, too, after the others
/// \param remark see factors_cache.h
tl::expected<MadeSolver, Error> makeSolver(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const std::filesystem::path& stateDirectory, const Steps& steps = {},
                                           const Remark& remark = {});

/// Returns how much memory the process takes while the solver of a gel without an influence file, and that for the
/// places of a zero, are made [bytes]. Measured with 12 x 12 to 56 x 56 nodes and 288 to 3,200 markers: up to a quarter
/// less.
double neededMemory(const sensor::Sensor& sensor);

/// Returns whether makeSolverAtRest() is possible: for a gel without an influence file.
bool followsRest(const sensor::Sensor& sensor);

/// A solver for the places that the markers have in the gel by its rest picture; `places` are those it solves for.
struct SolverAtRest {
  std::unique_ptr<FieldSolver> solver;  ///< owns all that it needs; never null
  RestPlaces places;
};

/// Makes the solver for the places of the markers that a zero shows, from the factors that makeSolver() has cached in
/// the state directory. Takes some seconds. followsRest() must be true (asserted). Calls `stopping` between its steps,
/// of a second or two, or of many where the factors are not cached; if it returns true, takes no further step and fails
/// with EX_SOFTWARE. Fails as makeSolver(). The arguments need not outlive the solver.
/// \param place_px, present as in RestPose
/// \param detectionLimit_N of the solver for the places of the gel file: it is taken over, as it changes little
tl::expected<SolverAtRest, Error>
makeSolverAtRest(const sensor::Sensor& sensor, const SolveOptions& options, const std::filesystem::path& stateDirectory,
                 std::span<const float> place_px, std::span<const std::uint8_t> present,
                 const std::array<double, 2>& detectionLimit_N, const Remark& remark = {},
                 const std::function<bool()>& stopping = {});

}  // namespace tractiond::solve
