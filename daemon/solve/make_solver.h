// The one place where a solver is chosen and made.
#pragma once

#include "daemon/solve/field_solver.h"
#include "daemon/solve/inverse_cache.h"

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

}  // namespace tractiond::solve
