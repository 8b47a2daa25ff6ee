#include "daemon/solve/factors_cache.h"

#include "base/clock.h"
#include "base/directory.h"
#include "base/hash.h"
#include "daemon/solve/factors_file.h"
#include "daemon/solve/systematic.h"
#include "sensor/elastic/influence.h"

#include <algorithm>
#include <functional>
#include <future>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

/// To be raised when the influence matrix's or the factors' numbers change for the same sensor and options.
constexpr std::uint32_t kFactorsVersion = 4;

constexpr std::size_t kKeptOthers = 3;
constexpr const char* kExtension = ".factors";
constexpr const char* kUnfinished = ".unfinished";  // replaceWholeFile() adds it while it writes

/// Deletes what an interrupted save left behind, and all caches but `saved` and the newest others.
void prune(const fs::path& saved, const Remark& remark) {
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  for (const fs::path& path : entriesOf(saved.parent_path())) {
    if (path.extension() == kExtension && path != saved) files.emplace_back(fs::last_write_time(path, error), path);
    if (path.extension() == kUnfinished && path.stem().extension() == kExtension) fs::remove(path, error);
  }
  std::sort(files.rbegin(), files.rend());
  for (std::size_t i = kKeptOthers; i < files.size(); ++i) {
    if (fs::remove(files[i].second, error)) remark("deleted the old cache " + files[i].second.string());
  }
}

/// Feeds everything of the sensor that the numbers depend on.
void addSensor(const sensor::Sensor& sensor, Hasher& hasher) {
  const auto vector = [&hasher](const auto& v) { hasher.range(std::span(v.data(), v.size())); };
  hasher.value(sensor.gel.youngsModulus);
  hasher.value(sensor.gel.poissonRatio);
  vector(sensor.gel.size);
  vector(sensor::markerPositions(sensor));
  vector(sensor::nodePositions(sensor));
  if (sensor.body) {
    hasher.value(sensor.body->youngsModulus);
    vector(sensor.body->influence);
    for (const Eigen::MatrixXd& each : sensor.body->errors) vector(each);
    hasher.value(sensor.nodes.columns);
  }
  if (sensor.body || sensor.nodes.count() == 1) hasher.value(sensor.nodes.pitch);  // else given by the places
  const sensor::Camera& camera = sensor.camera;
  hasher.value(camera.focal_px);
  vector(camera.principal_px);
  hasher.value(camera.k1);
  hasher.value(camera.k2);
  vector(camera.position);
  vector(camera.rotation);
  hasher.value(camera.gelIndex);
  hasher.value(camera.windowIndex);
  hasher.value(camera.windowThickness);
  for (const sensor::RefractingSurface& surface : camera.surfaces) {
    vector(surface.centre);
    vector(surface.radii);
    hasher.value(surface.index);
  }
  vector(sensor.uncertainty.position);
  vector(sensor.uncertainty.rotation);
  hasher.value(sensor.uncertainty.focal);
  hasher.value(sensor.uncertainty.focalDistance);
  hasher.value(sensor.uncertainty.poissonRatio);
  hasher.value(sensor.uncertainty.thickness);
  hasher.value(sensor.uncertainty.layerDepth);
  hasher.value(isWeighed(sensor));
  vector(motionPrior(sensor).variances);
  // What has its default is left out: caches from before the key existed keep their id.
  if (camera.aspect != 1.0) hasher.value(camera.aspect);
  if (sensor.markerCount() < sensor::kVerifying) hasher.value(sensor::kVerifying);  // whose deviations are wider since
  if (camera.fisheye) {
    hasher.text("fisheye");
    hasher.value(camera.k3);
    hasher.value(camera.k4);
  }
  if (sensor.uncertainty.markerDepth != 0.0) hasher.value(sensor.uncertainty.markerDepth);
}

Id factorsId(const sensor::Sensor& sensor, const SolveOptions& options) {
  Hasher hasher;
  hasher.text("factors");
  hasher.value(kFactorsVersion);
  hasher.value(options.model);
  hasher.value(options.noise_px);
  hasher.value(options.faintest);
  addSensor(sensor, hasher);
  return hasher.digest();
}

}  // namespace

Id calibrationId(const sensor::Sensor& sensor, const SolveOptions& options) {
  const Id factors = factorsId(sensor, options);
  if (sensor.creep.empty()) return factors;
  Hasher hasher;
  hasher.bytes(factors.data(), factors.size());
  for (const sensor::CreepTerm& term : sensor.creep) {
    hasher.value(term.share);
    hasher.value(term.time_s);
    hasher.value(term.deviation);
    hasher.range(std::span<const double>(term.correlation));
  }
  return hasher.digest();
}

tl::expected<Factors, Error> loadOrComputeFactors(const sensor::Sensor& sensor, const Atoms& atoms,
                                                  const SolveOptions& options, const fs::path& stateDirectory,
                                                  const Steps& steps, const Remark& remark) {
  const auto say = [&remark](const std::string& line) {
    if (remark) remark(line);
  };
  const Id id = factorsId(sensor, options);
  const fs::path path = cachePath(stateDirectory, id);
  auto cached = loadFactors(path, id, 2 * sensor.markerCount(), atoms);
  if (cached) return *std::move(cached);
  // A gel seen for the first time is no remark; a cache that is there and cannot be used is one.
  if (std::error_code none; fs::exists(path, none) || !fs::is_directory(stateDirectory, none)) {
    say("computing the factors: " + cached.error());
  }
  std::future<Strays> strays;  // while one core finds the eigenvectors
  auto factors = computeFactors(sensor, atoms, options, [&](Step step, double done) {
    if (step == Step::kModes) strays = std::async(straysOf, std::cref(sensor), std::cref(options));
    if (steps) steps(step, done);
  });
  if (!factors) return factors;
  if (steps) steps(Step::kSystematicErrors, 0.0);
  factors->systematicErrors = systematicErrors(sensor, options, *factors, atoms, strays.get());
  factors->id = id;
  factors->computed_ns = realNow();

  std::error_code error;
  fs::create_directories(stateDirectory, error);
  if (const auto saved = saveFactors(path, *factors); !saved) {
    say("the factors are not cached and will be computed again at the next start: " + saved.error());
  } else {
    prune(path, say);
  }
  return factors;
}

fs::path cachePath(const fs::path& directory, const Id& id) {
  return directory / (toHex(id) + kExtension);
}

}  // namespace tractiond::solve
