// The one place where a solver is chosen and made.
#pragma once

#include "daemon/solve/field_solver.h"
#include "daemon/solve/inverse_cache.h"
#include "daemon/solve/rest_places.h"

#include <functional>
#include <memory>

namespace tractiond::solve {

/// The hash of everything that the numbers of a solver with these options depend on: the calibration's id.
Id calibrationId(const sensor::Sensor& sensor, const SolveOptions& options);

struct MadeSolver {
  std::unique_ptr<FieldSolver> solver;
  std::int64_t computed_ns = 0;  ///< CLOCK_REALTIME when the numbers it solves with were computed
};

/// Makes the solver that SolveOptions::solving names, with what it needs from the state directory or computed. Fails
/// where that cannot be computed.
tl::expected<MadeSolver, Error> makeSolver(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const std::filesystem::path& stateDirectory,
                                           const sensor::elastic::Progress& progress = {}, const Remark& remark = {});

/// Returns whether a solver with these options can be made for the places of the markers that a zero shows: the
/// model's, of a block.
bool followsRest(const sensor::Sensor& sensor, const SolveOptions& options);

/// A solver for the markers of a gel as it was made.
struct SolverAtRest {
  std::unique_ptr<FieldSolver> solver;
  RestPlaces places;
};

/// Makes the solver for the places that the zero shows, from what makeSolver() has left in the state directory. Takes
/// some seconds. Must only be called if followsRest(). Fails after the next step when `stopping` returns true; the
/// longest step, the factors, takes nine tenths of the time. \param place_px, present as in RestPose
/// \param detectionLimit_N of the solver for the gel file's places; scatter changes it little
tl::expected<SolverAtRest, Error>
makeSolverAtRest(const sensor::Sensor& sensor, const SolveOptions& options, const std::filesystem::path& stateDirectory,
                 std::span<const float> place_px, std::span<const std::uint8_t> present,
                 const std::array<double, 2>& detectionLimit_N, const Remark& remark = {},
                 const std::function<bool()>& stopping = {});

}  // namespace tractiond::solve
