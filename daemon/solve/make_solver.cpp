#include "daemon/solve/make_solver.h"

#include "daemon/solve/model_solver.h"
#include "daemon/solve/solver.h"

#include <utility>

namespace tractiond::solve {
namespace {

struct OwnInverse {
  Inverse own;
};

class OwningSolver : OwnInverse, public Solver {
 public:
  OwningSolver(Inverse inverse, const sensor::Sensor& sensor, const SolveOptions& options)
      : OwnInverse{std::move(inverse)}
      , Solver(own, sensor, options) {}
};

struct OwnFactors {
  Atoms atoms;
  Factors factors;
};

class OwningModelSolver : OwnFactors, public ModelSolver {
 public:
  OwningModelSolver(OwnFactors own, const sensor::Sensor& sensor, const SolveOptions& options)
      : OwnFactors(std::move(own))
      , ModelSolver(OwnFactors::factors, OwnFactors::atoms, sensor, options) {}
};

}  // namespace

Id calibrationId(const sensor::Sensor& sensor, const SolveOptions& options) {
  return options.solving == Solving::kModel ? factorsId(sensor, options) : inverseId(sensor, options);
}

tl::expected<MadeSolver, Error> makeSolver(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const std::filesystem::path& stateDirectory,
                                           const sensor::elastic::Progress& progress, const Remark& remark) {
  if (options.solving == Solving::kModel) {
    Atoms atoms = makeAtoms(sensor);
    auto factors = loadOrComputeFactors(sensor, atoms, options, stateDirectory, progress, remark);
    if (!factors) return tl::unexpected(factors.error());
    const std::int64_t computed_ns = factors->computed_ns;
    return MadeSolver{
        std::make_unique<OwningModelSolver>(OwnFactors{std::move(atoms), *std::move(factors)}, sensor, options),
        computed_ns};
  }
  auto inverse = loadOrCompute(sensor, options, stateDirectory, progress, remark);
  if (!inverse) return tl::unexpected(inverse.error());
  const std::int64_t computed_ns = inverse->computed_ns;
  return MadeSolver{std::make_unique<OwningSolver>(*std::move(inverse), sensor, options), computed_ns};
}

}  // namespace tractiond::solve
