#include "daemon/solve/make_solver.h"

#include "daemon/solve/model_solver.h"

#include <malloc.h>

#include <cassert>
#include <optional>
#include <utility>

namespace tractiond::solve {
namespace {

struct OwnFactors {
  Atoms atoms;
  Factors factors;
};

class OwningModelSolver : OwnFactors, public ModelSolver {
 public:
  OwningModelSolver(OwnFactors own, const sensor::Sensor& sensor, const SolveOptions& options,
                    const std::optional<std::array<double, 2>>& detectionLimit_N = {})
      : OwnFactors(std::move(own))
      , ModelSolver(OwnFactors::factors, OwnFactors::atoms, sensor, options, detectionLimit_N) {}
};

/// While one exists, the C library keeps what a matrix frees for the next one: to take each page anew would take half
/// as long as the computing. Then it gives everything back, and large pieces at once from then on.
struct KeptMemory {
  KeptMemory() {
    constexpr int kAll = 1 << 30;
    mallopt(M_MMAP_THRESHOLD, kAll);
    mallopt(M_TRIM_THRESHOLD, kAll);
  }
  ~KeptMemory() {
    mallopt(M_MMAP_THRESHOLD, 1 << 20);
    mallopt(M_TRIM_THRESHOLD, 1 << 17);
    malloc_trim(0);
  }
};

}  // namespace

tl::expected<MadeSolver, Error> makeSolver(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const std::filesystem::path& stateDirectory, const Steps& steps,
                                           const Remark& remark) {
  const KeptMemory kept;
  Atoms atoms = makeAtoms(sensor);
  auto factors = loadOrComputeFactors(sensor, atoms, options, stateDirectory, steps, remark);
  if (!factors) return tl::unexpected(factors.error());
  if (steps) steps(Step::kDetectionLimit, 0.0);
  const std::int64_t computed_ns = factors->computed_ns;
  return MadeSolver{
      std::make_unique<OwningModelSolver>(OwnFactors{std::move(atoms), *std::move(factors)}, sensor, options),
      computed_ns};
}

double neededMemory(const sensor::Sensor& sensor) {
  constexpr double kAnyway_bytes = 250e6, kOfAtoms = 190.0, kOfMarkers = 95.0;
  const double atoms = 1.35 * (sensor.nodes.columns + 4) * (sensor.nodes.rows + 4), markers = sensor.markerCount();
  return kAnyway_bytes + kOfAtoms * atoms * atoms + kOfMarkers * markers * markers;
}

bool followsRest(const sensor::Sensor& sensor) {
  return !sensor.body;
}

tl::expected<SolverAtRest, Error> makeSolverAtRest(const sensor::Sensor& sensor, const SolveOptions& options,
                                                   const std::filesystem::path& stateDirectory,
                                                   std::span<const float> place_px,
                                                   std::span<const std::uint8_t> present,
                                                   const std::array<double, 2>& detectionLimit_N, const Remark& remark,
                                                   const std::function<bool()>& stopping) {
  assert(followsRest(sensor));
  const tl::unexpected givenUp(Error{.what = "given up, as the daemon stops"});
  const auto isStopped = [&] { return stopping && stopping(); };
  if (isStopped()) return givenUp;
  const KeptMemory kept;
  SolverAtRest made{.solver = {}, .places = restPlaces(sensor, place_px, present)};
  sensor::Sensor measured = sensor;
  measured.scatter = made.places.scatter;
  OwnFactors own{makeAtoms(sensor), {}};
  {
    auto drawn = loadOrComputeFactors(sensor, own.atoms, options, stateDirectory, {}, remark);
    if (!drawn) return tl::unexpected(drawn.error());
    if (isStopped()) return givenUp;
    // Frees what is not used any more, to take less memory at a time.
    drawn->gram = {};
    drawn->left = {};
    Eigen::MatrixXd influence = influenceAtPlaces(measured, own.atoms, *drawn);
    if (isStopped()) return givenUp;
    drawn->influence = {};
    auto factors =
        computeFactors(std::move(influence), own.atoms, motionPrior(measured), drawn->force_N, options, &*drawn);
    if (!factors) return tl::unexpected(factors.error());
    own.factors = *std::move(factors);
  }
  if (isStopped()) return givenUp;
  made.solver = std::make_unique<OwningModelSolver>(std::move(own), measured, options, detectionLimit_N);
  return made;
}

}  // namespace tractiond::solve
