#include "daemon/solve/inverse_cache.h"

#include "base/clock.h"
#include "base/hash.h"
#include "daemon/solve/inverse_file.h"
#include "daemon/solve/systematic.h"
#include "sensor/elastic/influence.h"

#include <algorithm>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

/// To be raised when the influence matrix's or the inverse's or the factors' numbers change for the same sensor and
/// options.
constexpr std::uint32_t kAlgorithmVersion = 2, kFactorsVersion = 3;

constexpr std::size_t kKeptOthers = 3;
constexpr const char* kExtension = ".inverse";
constexpr const char* kFactorsExtension = ".factors";
constexpr const char* kUnfinished = ".unfinished";  // replaceWholeFile() adds it while it writes

/// Deletes what an interrupted save left behind and all caches of the kind of `saved` but it and the newest others.
void prune(const fs::path& saved, const Remark& remark) {
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  for (const auto& entry : fs::directory_iterator(saved.parent_path(), error)) {
    const fs::path& path = entry.path();
    if (path.extension() == saved.extension() && path != saved) files.emplace_back(entry.last_write_time(error), path);
    if (path.extension() == kUnfinished && path.stem().extension() == saved.extension()) fs::remove(path, error);
  }
  std::sort(files.rbegin(), files.rend());
  for (std::size_t i = kKeptOthers; i < files.size(); ++i) {
    if (fs::remove(files[i].second, error)) remark("deleted the old cache " + files[i].second.string());
  }
}

/// Feeds everything of the sensor that the numbers depend on.
void addSensor(const sensor::Sensor& sensor, Hasher& hasher) {
  const auto vector = [&hasher](const auto& v) {
    hasher.range(std::span(v.data(), static_cast<std::size_t>(v.size())));
  };
  hasher.value(sensor.gel.youngsModulus);
  hasher.value(sensor.gel.poissonRatio);
  vector(sensor.gel.size);
  vector(sensor::markerPositions(sensor));
  vector(sensor::nodePositions(sensor));
  if (sensor.body) {
    hasher.value(sensor.body->youngsModulus);
    vector(sensor.body->influence);
  }
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
  if (sensor.uncertainty.markerDepth != 0.0) hasher.value(sensor.uncertainty.markerDepth);
}

/// The content of the file at `path` if load() gives it, else what compute() gives, which save(path, content) then
/// caches.
template <typename Load, typename Compute, typename Save>
auto loadOr(const fs::path& path, Load load, Compute compute, Save save, const Remark& remark) -> decltype(compute()) {
  const auto say = [&remark](const std::string& line) {
    if (remark) remark(line);
  };
  const fs::path stateDirectory = path.parent_path();
  auto cached = load();
  if (cached) return std::move(*cached);
  // A gel seen for the first time is no remark; a cache that is there and cannot be used is one.
  if (std::error_code none; fs::exists(path, none) || !fs::is_directory(stateDirectory, none)) {
    say("computing the inverse: " + cached.error());
  }
  auto computed = compute();
  if (!computed) return computed;
  computed->computed_ns = realNow();

  std::error_code error;
  fs::create_directories(stateDirectory, error);
  if (const auto saved = save(path, *computed); !saved) {
    say("the inverse is not cached and will be computed again at the next start: " + saved.error());
  } else {
    prune(path, say);
  }
  return computed;
}

}  // namespace

Id inverseId(const sensor::Sensor& sensor, const SolveOptions& options) {
  Hasher hasher;
  hasher.value(kAlgorithmVersion);
  hasher.value(options.model);
  hasher.value(options.regularisation);
  hasher.value(options.truncation);
  hasher.value(options.noise_px);
  addSensor(sensor, hasher);
  return hasher.digest();
}

Id factorsId(const sensor::Sensor& sensor, const SolveOptions& options) {
  const ModelOptions model = modelOptions(options);
  Hasher hasher;
  hasher.text("factors");
  hasher.value(kFactorsVersion);
  hasher.value(model.mechanics);
  hasher.value(model.noise_px);
  hasher.value(model.faintest);
  addSensor(sensor, hasher);
  return hasher.digest();
}

tl::expected<Inverse, Error> loadOrCompute(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const fs::path& stateDirectory, const sensor::elastic::Progress& progress,
                                           const Remark& remark) {
  const Id id = inverseId(sensor, options);
  const fs::path path = cachePath(stateDirectory, id);
  const auto compute = [&]() -> tl::expected<Inverse, Error> {
    constexpr double kInfluenceShare = 0.7;  // of the time
    const auto part = [&progress](double start, double share) -> sensor::elastic::Progress {
      if (!progress) return {};
      return [&progress, start, share](double fraction) { progress(start + share * fraction); };
    };
    const Eigen::MatrixXd displacement =
        sensor::elastic::displacementMatrix(sensor, options.model, part(0.0, kInfluenceShare));
    auto inverse = computeInverse(sensor::elastic::toImage(sensor, displacement), motionPrior(sensor), options,
                                  part(kInfluenceShare, 1.0 - kInfluenceShare));
    if (!inverse) return inverse;
    inverse->systematicErrors = systematicErrors(sensor, options, *inverse);
    inverse->id = id;
    return inverse;
  };
  return loadOr(
      path, [&] { return loadInverse(path, id, 2 * sensor.markerCount(), 3 * sensor.nodes.count()); }, compute,
      saveInverse, remark);
}

tl::expected<Factors, Error> loadOrComputeFactors(const sensor::Sensor& sensor, const Atoms& atoms,
                                                  const SolveOptions& options, const fs::path& stateDirectory,
                                                  const sensor::elastic::Progress& progress, const Remark& remark) {
  const Id id = factorsId(sensor, options);
  const fs::path path = factorsPath(stateDirectory, id);
  const auto compute = [&]() -> tl::expected<Factors, Error> {
    auto factors = computeFactors(sensor, atoms, modelOptions(options), progress);
    if (!factors) return factors;
    factors->systematicErrors = systematicErrors(sensor, options, *factors, atoms);
    factors->id = id;
    return factors;
  };
  return loadOr(
      path, [&] { return loadFactors(path, id, 2 * sensor.markerCount(), atoms); }, compute, saveFactors, remark);
}

fs::path cachePath(const fs::path& directory, const Id& id) {
  return directory / (toHex(id) + kExtension);
}

fs::path factorsPath(const fs::path& directory, const Id& id) {
  return directory / (toHex(id) + kFactorsExtension);
}

}  // namespace tractiond::solve
