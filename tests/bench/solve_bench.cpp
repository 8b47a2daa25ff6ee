// What solving one frame costs: 1152 markers, 576 nodes, one thread. "Flushed" evicts the factors from the caches
// before each frame, as a camera at 60 frames/s and the machine's other work do.
#include "daemon/solve/creep_errors.h"
#include "daemon/solve/factors_cache.h"
#include "daemon/solve/model_solver.h"
#include "daemon/track/creep_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/solve/sensors.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <random>

namespace tractiond::solve {
namespace {

const sensor::Sensor kSensor;
constexpr double kBall = 1.8;  // reach [pitches] of a ball of 5 mm

const Atoms& theAtoms() {
  static const Atoms atoms = makeAtoms(kSensor);
  return atoms;
}

const Factors& theFactors() {
  static const test::TemporaryFolder directory;
  static const Factors factors = *loadOrComputeFactors(kSensor, theAtoms(), SolveOptions{}, directory.path());
  return factors;
}

ModelSolver& theSolver() {
  static ModelSolver solver(theFactors(), theAtoms(), kSensor);
  return solver;
}

/// An even force of 4 N on the nodes up to `reach` [pitches] from the middle, and noise; `missing` markers, chosen by
/// the seed.
MarkerField pressed(double reach, int missing, unsigned seed) {
  static const Eigen::MatrixXd influence = [] {
    const Factors& factors = theFactors();
    Eigen::MatrixXd h(factors.coordinateCount(), 3 * kSensor.nodes.count());
    for (int p = 0; p < theAtoms().pointCount(); ++p) {
      const int node = theAtoms().nodes[static_cast<std::size_t>(p)];
      for (int axis = 0; node >= 0 && axis < 3; ++axis)
        h.col(3 * node + axis) = Eigen::VectorXf::Map(factors.influence.row(3 * p + axis), h.rows()).cast<double>();
    }
    return h;
  }();
  Eigen::VectorXd forces = Eigen::VectorXd::Zero(influence.cols());
  const sensor::Points nodes = sensor::nodePositions(kSensor.nodes);
  for (Eigen::Index n = 0; n < nodes.cols(); ++n) {
    if (std::hypot(nodes(0, n), nodes(1, n)) <= reach * kSensor.nodes.pitch) forces[3 * n + 2] = 1.0;
  }
  forces *= 4.0 / forces.sum();
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.018);
  Eigen::VectorXd displacement = influence * forces;
  for (double& d : displacement) d += noise(random);
  MarkerField field = fieldOf(displacement);
  std::fill(field.variance_px2.begin(), field.variance_px2.end(), 0.018F * 0.018F);
  while (field.validCount > kSensor.markerCount() - missing) {
    loseMarker(field, static_cast<int>(random() % field.valid.size()));
  }
  return field;
}

/// A ball of 5 mm.
void solveBall(benchmark::State& state, bool flush) {
  ModelSolver& solver = theSolver();
  const MarkerField field = pressed(kBall, 0, 1);
  TractionField forces;
  forces.resize(kSensor.markerCount(), kSensor.nodes.count());
  solver.solve(field, forces);
  std::vector<char> other(flush ? std::size_t{128} << 20 : 0);
  for (auto _ : state) {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
    benchmark::ClobberMemory();
    const auto start = std::chrono::steady_clock::now();
    solver.solve(field, forces);
    state.SetIterationTime(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
}
void solveInCache(benchmark::State& state) {
  solveBall(state, false);
}
void solveFlushed(benchmark::State& state) {
  solveBall(state, true);
}

/// The whole face, a tenth of the markers missing, others in every frame.
void solveFullFace(benchmark::State& state) {
  ModelSolver& solver = theSolver();
  std::vector<MarkerField> fields;
  for (unsigned i = 0; i < 16; ++i) fields.push_back(pressed(100.0, 115, i));
  TractionField forces;
  forces.resize(kSensor.markerCount(), kSensor.nodes.count());
  std::size_t frame = 0;
  std::vector<double> durations;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    solver.solve(fields[frame++ % fields.size()], forces);
    const std::chrono::duration<double> duration = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(duration.count());
    durations.push_back(duration.count());
  }
  std::sort(durations.begin(), durations.end());
  state.counters["p99_ms"] = 1e3 * durations[durations.size() * 99 / 100];
}

/// What five terms of creep add to a frame with one contact: taken off, and what errors of them do.
void creep(benchmark::State& state) {
  sensor::Sensor sensor;
  for (const double time_s : {1.0, 4.0, 15.0, 120.0, 1200.0}) {
    sensor.creep.push_back({.share = 0.02, .time_s = time_s, .deviation = 0.002, .correlation = {}});
  }
  track::CreepMemory memory(sensor.creep, sensor.markerCount());
  CreepErrors errors(sensor);
  MarkerField field = pressed(kBall, 0, 1);
  for (auto _ : state) {
    field.info.times.captured_ns += 16'666'667;
    memory.advance(field);
    errors.take(field);
    benchmark::DoNotOptimize(errors.about({0.0, 0.0, 0.0}));
  }
}

BENCHMARK(solveInCache)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(solveFlushed)->UseManualTime()->Iterations(100)->Unit(benchmark::kMillisecond);
BENCHMARK(solveFullFace)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(creep)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tractiond::solve

BENCHMARK_MAIN();
