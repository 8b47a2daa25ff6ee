// What solving one frame costs: 1152 markers, 576 nodes, one thread. "Flushed" evicts the factors from the caches
// before each frame, as a camera at 60 frames/s and the machine's other work do.
#include "daemon/solve/creep_errors.h"
#include "daemon/solve/factors_cache.h"
#include "daemon/solve/model_solver.h"
#include "daemon/track/creep_memory.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/solve/sensors.h"

#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <random>

namespace tractiond::solve {
namespace {

const sensor::Sensor kSensor;

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

/// An even force on the nodes from `inner` to `reach` [pitches] around the middle, or around the places `distance` / 2
/// [m] beside it, or `up` [m] above; or, with `apart`, as far above and below, in four places.
struct Load {
  double reach = 1.8;  ///< that of a ball of 5 mm
  double distance = 0.0, apart = 0.0, up = 0.0, inner = 0.0;
  double force_N = 4.0;
};

/// A load and noise; `missing` markers, chosen by the seed.
MarkerField pressed(const Load& load, int missing, unsigned seed) {
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
    const double y = load.apart > 0.0 ? std::abs(nodes(1, n)) - 0.5 * load.apart : nodes(1, n) - load.up;
    const double away = std::hypot(std::abs(nodes(0, n)) - 0.5 * load.distance, y);
    if (away >= load.inner * kSensor.nodes.pitch && away <= load.reach * kSensor.nodes.pitch) forces[3 * n + 2] = 1.0;
  }
  forces *= load.force_N / forces.sum();
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

void runSolver(benchmark::State& state, bool flush) {
  ModelSolver& solver = theSolver();
  const MarkerField field = pressed({}, static_cast<int>(state.range(0)), 1);
  TractionField forces;
  forces.resize(kSensor.markerCount(), kSensor.nodes.count());
  solver.solve(field, forces);
  std::vector<char> other(flush ? std::size_t{128} << 20 : 0);
  std::vector<double> durations;
  for (auto _ : state) {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
    benchmark::ClobberMemory();
    const auto start = std::chrono::steady_clock::now();
    solver.solve(field, forces);
    const std::chrono::duration<double> duration = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(duration.count());
    durations.push_back(duration.count());
  }
  const auto median = durations.begin() + static_cast<std::ptrdiff_t>(durations.size() / 2);
  std::nth_element(durations.begin(), median, durations.end());
  state.counters["median_ms"] = 1e3 * *median;
  state.counters["rank"] = theFactors().rank();
  state.counters["MB"] =
      static_cast<double>(theFactors().left.all().size_bytes() + theFactors().right.all().size_bytes()) / 1e6;
}

/// Other markers missing in every frame.
void solvePressed(benchmark::State& state, const Load& load, int missing) {
  ModelSolver& solver = theSolver();
  std::vector<MarkerField> fields;
  for (unsigned i = 0; i < 16; ++i) fields.push_back(pressed(load, missing, i));
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
  state.counters["p50_ms"] = 1e3 * durations[durations.size() / 2];
  state.counters["p99_ms"] = 1e3 * durations[durations.size() * 99 / 100];
  state.counters["contacts"] = forces.contactCount;
  state.counters["method"] = static_cast<int>(forces.method);
}

/// Answers by the model of the first frame.
void answerPressed(benchmark::State& state, const Load& load, int missing, bool flush) {
  ModelSolver& solver = theSolver();
  TractionField forces;
  forces.resize(kSensor.markerCount(), kSensor.nodes.count());
  std::vector<MarkerField> fields;
  for (unsigned i = 0; i < 9; ++i) {
    fields.push_back(pressed(load, missing, i));
    fields.back().info.frameNumber = i + 1;
  }
  solver.solve(fields.front(), forces);
  solver.learn();
  std::vector<char> other(flush ? std::size_t{64} << 20 : 0);
  std::vector<double> durations;
  std::size_t answered = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < other.size(); i += 64) ++other[i];
    benchmark::ClobberMemory();
    const auto start = std::chrono::steady_clock::now();
    answered += solver.answer(fields[1 + durations.size() % 8], forces);
    const std::chrono::duration<double> duration = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(duration.count());
    durations.push_back(duration.count());
  }
  std::sort(durations.begin(), durations.end());
  state.counters["p50_ms"] = 1e3 * durations[durations.size() / 2];
  state.counters["answered"] = static_cast<double>(answered) / static_cast<double>(durations.size());
}

/// The argument: missing markers, the same in every frame.
void solveInCache(benchmark::State& state) {
  runSolver(state, false);
}
void solveFlushed(benchmark::State& state) {
  runSolver(state, true);
}

/// So many markers go missing at once and come back in the next frame; a pair of frames is timed.
void solveChanging(benchmark::State& state) {
  ModelSolver& solver = theSolver();
  const MarkerField whole = pressed({}, 0, 1), holed = pressed({}, static_cast<int>(state.range(0)), 1);
  TractionField forces;
  forces.resize(kSensor.markerCount(), kSensor.nodes.count());
  for (auto _ : state) {
    solver.solve(holed, forces);
    solver.solve(whole, forces);
  }
}

/// A new sensor's start: influence matrix of the block, factors, cache. The peak is the process's: run it first or
/// alone.
void prepareCold(benchmark::State& state) {
  const test::TemporaryFolder directory;
  for (auto _ : state) {
    benchmark::DoNotOptimize(loadOrComputeFactors(kSensor, theAtoms(), SolveOptions{}, directory.path()));
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  state.counters["peak_MB"] = static_cast<double>(usage.ru_maxrss) / 1e3;
}

/// What five terms of creep add to a frame with one contact: taken off, and what errors of them do.
void creep(benchmark::State& state) {
  sensor::Sensor sensor;
  for (const double time_s : {1.0, 4.0, 15.0, 120.0, 1200.0}) {
    sensor.creep.push_back({.share = 0.02, .time_s = time_s, .deviation = 0.002, .correlation = {}});
  }
  track::CreepMemory memory(sensor.creep, sensor.markerCount());
  CreepErrors errors(sensor);
  MarkerField field = pressed({}, 0, 1);
  for (auto _ : state) {
    field.info.times.captured_ns += 16'666'667;
    memory.advance(field);
    errors.take(field);
    benchmark::DoNotOptimize(errors.about({0.0, 0.0, 0.0}));
  }
}

void prepareWarm(benchmark::State& state) {
  const test::TemporaryFolder directory;
  benchmark::DoNotOptimize(loadOrComputeFactors(kSensor, theAtoms(), SolveOptions{}, directory.path()));
  for (auto _ : state)
    benchmark::DoNotOptimize(loadOrComputeFactors(kSensor, theAtoms(), SolveOptions{}, directory.path()));
}

BENCHMARK(prepareCold)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();
BENCHMARK(solveInCache)->Arg(0)->Arg(115)->Arg(288)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(solveFlushed)->Arg(0)->Arg(115)->Arg(288)->UseManualTime()->Iterations(100)->Unit(benchmark::kMillisecond);

#define BENCHMARK_LOAD(name, ...)                                                                                      \
  BENCHMARK_CAPTURE(solvePressed, name, __VA_ARGS__)->UseManualTime()->Unit(benchmark::kMillisecond)

constexpr int kTenth = 115;  // of the markers
const Load kBall, kDisc{.reach = 3.4}, kRing{.reach = 4.0, .inner = 2.7}, kPair{.reach = 0.8, .distance = 9e-3},
    kFour{.reach = 1.3, .distance = 28e-3, .apart = 22e-3, .force_N = 7.0}, kRim{.up = 30e-3}, kPalm{.reach = 10.0},
    kFullFace{.reach = 100.0}, kNoLoad{.force_N = 0.0};
BENCHMARK_LOAD(press, kBall, 0);
BENCHMARK_LOAD(pressChangingMarkers, kBall, kTenth);
BENCHMARK_LOAD(disc, kDisc, 0);
BENCHMARK_LOAD(ring, kRing, 0);
BENCHMARK_LOAD(pair, kPair, 0);
BENCHMARK_LOAD(pairChangingMarkers, kPair, kTenth);
BENCHMARK_LOAD(rim, kRim, 0);
BENCHMARK_LOAD(rimChangingMarkers, kRim, kTenth);
BENCHMARK_LOAD(palm, kPalm, 0);
BENCHMARK_LOAD(fullFaceChangingMarkers, kFullFace, kTenth);
BENCHMARK_LOAD(noLoad, kNoLoad, 0);

#define BENCHMARK_ANSWER(name, ...)                                                                                    \
  BENCHMARK_CAPTURE(answerPressed, name, __VA_ARGS__, false)                                                           \
      ->UseManualTime()                                                                                                \
      ->Iterations(100)                                                                                                \
      ->Unit(benchmark::kMillisecond);                                                                                 \
  BENCHMARK_CAPTURE(answerPressed, name##Flushed, __VA_ARGS__, true)                                                   \
      ->UseManualTime()                                                                                                \
      ->Iterations(100)                                                                                                \
      ->Unit(benchmark::kMillisecond)
BENCHMARK_ANSWER(press, kBall, 0);
BENCHMARK_ANSWER(pressMissingMarkers, kBall, kTenth);
BENCHMARK_ANSWER(pair, kPair, 0);
BENCHMARK_ANSWER(four, kFour, 0);
BENCHMARK_ANSWER(palm, kPalm, 0);
BENCHMARK_ANSWER(fullFaceMissingMarkers, kFullFace, kTenth);
BENCHMARK_ANSWER(noLoad, kNoLoad, 0);
BENCHMARK(solveChanging)->Arg(1)->Arg(115)->Arg(288)->Unit(benchmark::kMillisecond);
BENCHMARK(creep)->Unit(benchmark::kMillisecond);
BENCHMARK(prepareWarm)->Unit(benchmark::kMillisecond)->Iterations(10)->UseRealTime();

}  // namespace
}  // namespace tractiond::solve

BENCHMARK_MAIN();
