// The file: a header with sizes and a checksum of itself and all that follows, then the inverse's arrays as they
// are in memory. It is read, not mapped, so a file that is cut short while we run does us no harm, and checked before
// any of it is used.
#include "daemon/solve/inverse_cache.h"

#include "daemon/base/clock.h"
#include "daemon/base/hash.h"
#include "daemon/base/whole_file.h"
#include "daemon/solve/systematic.h"
#include "sensor/elastic/influence.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <system_error>
#include <utility>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

/// To be raised when the influence matrix's or the inverse's numbers change for the same sensor and options.
constexpr std::uint32_t kAlgorithmVersion = 2;

/// To be raised when the file's layout changes.
constexpr std::uint32_t kFormatVersion = 3;
constexpr std::array<char, 8> kMagic = {'t', 'r', 'a', 'c', 't', 'i', 'n', 'v'};

constexpr std::size_t kKeptOthers = 3;
constexpr const char* kExtension = ".inverse";
constexpr const char* kUnfinished = ".unfinished";  // replaceWholeFile() adds it while it writes

/// In the machine's byte order: the cache stays on the machine, and another order's version would not be known.
struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t formatVersion = kFormatVersion;
  std::int32_t coordinateCount = 0;
  std::int32_t forceCount = 0;
  std::int32_t rank = 0;
  Id id{};
  std::int64_t computed_ns = 0;
  double lambda = 0.0;
  std::uint64_t systematicErrors = 0;  ///< numbers in either array
  Hash128 checksum{};                  ///< of the header up to here, then of all that follows
};
static_assert(sizeof(Header) == 80);  // no padding
constexpr std::size_t kCheckedHeader = offsetof(Header, checksum);

/// Calls `use` with each array's memory in the file's order.
template <typename AnInverse, typename Use>
void forEachArray(AnInverse& inverse, Use use) {
  use(std::span(inverse.singularValues));
  use(inverse.left.all());
  use(inverse.right.all());
  use(std::span(inverse.motionGain));
  use(std::span(inverse.motionVariance));
  use(std::span(inverse.hat));
  use(inverse.influence.all());
  use(std::span(inverse.gram));
  use(inverse.motion.all());
  use(std::span(inverse.systematicErrors.contact));
  use(std::span(inverse.systematicErrors.wholeFace));
}

Hash128 checksum(const Header& header, std::span<const char> arrays) {
  Hasher hasher;
  hasher.bytes(&header, kCheckedHeader);
  hasher.bytes(arrays.data(), arrays.size());
  return hasher.digest();
}

/// Sizes the arrays as the header says.
void resize(Inverse& inverse, const Header& header) {
  const auto coordinates = static_cast<std::size_t>(header.coordinateCount);
  const auto forces = static_cast<std::size_t>(header.forceCount);
  inverse.singularValues.resize(static_cast<std::size_t>(header.rank));
  inverse.left = RowMatrix(header.coordinateCount, header.rank + kMotions);
  inverse.right = RowMatrix(header.rank, header.forceCount);
  inverse.motionGain.resize(kMotions);
  inverse.motionVariance.resize(kMotions);
  inverse.hat.resize(coordinates * (coordinates + 1) / 2);
  inverse.influence = RowMatrix(header.forceCount, header.coordinateCount);
  inverse.gram.resize(forces * (forces + 1) / 2);
  inverse.motion = RowMatrix(kMotions, header.coordinateCount);
  inverse.systematicErrors.contact.resize(header.systematicErrors);
  inverse.systematicErrors.wholeFace.resize(header.systematicErrors);
}

/// Deletes what an interrupted save left behind and all caches but `saved` and the newest others.
void prune(const fs::path& saved, const Remark& remark) {
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> files;
  for (const auto& entry : fs::directory_iterator(saved.parent_path(), error)) {
    const fs::path& path = entry.path();
    if (path.extension() == kExtension && path != saved) files.emplace_back(entry.last_write_time(error), path);
    if (path.extension() == kUnfinished && path.stem().extension() == kExtension) fs::remove(path, error);
  }
  std::sort(files.rbegin(), files.rend());
  for (std::size_t i = kKeptOthers; i < files.size(); ++i) {
    if (fs::remove(files[i].second, error)) remark("deleted the old cache " + files[i].second.string());
  }
}

Eigen::Vector4d motionVariances(const sensor::Sensor& sensor) {
  const sensor::PictureMotion& motion = sensor.pictureMotion;
  return Eigen::Vector4d(motion.shift_px, motion.shift_px, motion.scale, motion.roll).cwiseAbs2();
}

}  // namespace

Id inverseId(const sensor::Sensor& sensor, const SolveOptions& options) {
  Hasher hasher;
  const auto vector = [&hasher](const auto& v) {
    hasher.range(std::span(v.data(), static_cast<std::size_t>(v.size())));
  };
  hasher.value(kAlgorithmVersion);
  hasher.value(options.model);
  hasher.value(options.regularisation);
  hasher.value(options.truncation);
  hasher.value(options.noise_px);
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
  vector(motionVariances(sensor));
  return hasher.digest();
}

tl::expected<Inverse, Error> loadOrCompute(const sensor::Sensor& sensor, const SolveOptions& options,
                                           const fs::path& stateDirectory, const sensor::elastic::Progress& progress,
                                           const Remark& remark) {
  const auto say = [&remark](const std::string& line) {
    if (remark) remark(line);
  };
  const Id id = inverseId(sensor, options);
  const fs::path path = cachePath(stateDirectory, id);
  auto cached = loadInverse(path, id, 2 * sensor.markerCount(), 3 * sensor.nodes.count());
  if (cached) return std::move(*cached);
  // A gel seen for the first time is no remark; a cache that is there and cannot be used is one.
  if (std::error_code none; fs::exists(path, none) || !fs::is_directory(stateDirectory, none)) {
    say("computing the inverse: " + cached.error());
  }

  constexpr double kInfluenceShare = 0.7;  // of the time
  const auto part = [&progress](double start, double share) -> sensor::elastic::Progress {
    if (!progress) return {};
    return [&progress, start, share](double fraction) { progress(start + share * fraction); };
  };
  const Eigen::MatrixXd displacement =
      sensor::elastic::displacementMatrix(sensor, options.model, part(0.0, kInfluenceShare));
  auto inverse = computeInverse(sensor::elastic::toImage(sensor, displacement),
                                {sensor::elastic::pictureMotionMatrix(sensor), motionVariances(sensor)}, options,
                                part(kInfluenceShare, 1.0 - kInfluenceShare));
  if (!inverse) return inverse;
  inverse->systematicErrors = systematicErrors(sensor, options, *inverse);
  inverse->id = id;
  inverse->computed_ns = realNow();

  std::error_code error;
  fs::create_directories(stateDirectory, error);
  if (const auto saved = saveInverse(path, *inverse); !saved) {
    say("the inverse is not cached and will be computed again at the next start: " + saved.error());
  } else {
    prune(path, say);
  }
  return inverse;
}

fs::path cachePath(const fs::path& directory, const Id& id) {
  return directory / (toHex(id) + kExtension);
}

tl::expected<Inverse, std::string> loadInverse(const fs::path& path, const Id& id, int coordinateCount,
                                               int forceCount) {
  const auto reject = [&path](const std::string& reason) { return tl::unexpected(path.string() + ": " + reason); };
  const auto file = readWholeFile(path);
  if (!file) return reject(file.error().message());

  Header header;
  if (file->size() < sizeof header) return reject("shorter than its header");
  std::memcpy(&header, file->data(), sizeof header);
  if (header.magic != kMagic) return reject("not a cached inverse");
  if (header.formatVersion != kFormatVersion) return reject("written by another version");
  if (header.id != id) return reject("of another sensor");
  auto arrays = std::span<const char>(*file).subspan(sizeof header);
  if (header.checksum != checksum(header, arrays)) return reject("its checksum is wrong");
  if (header.coordinateCount != coordinateCount || header.forceCount != forceCount || header.rank < 1 ||
      header.rank > std::min(coordinateCount, forceCount) || header.systematicErrors % 36 != 0 ||
      header.systematicErrors > arrays.size()) {
    return reject("of another size");
  }

  Inverse inverse;
  inverse.id = header.id;
  inverse.computed_ns = header.computed_ns;
  inverse.lambda = header.lambda;
  resize(inverse, header);
  std::size_t size = 0;
  forEachArray(inverse, [&size](auto array) { size += array.size_bytes(); });
  if (arrays.size() != size) return reject("of another size");
  forEachArray(inverse, [&arrays](auto array) {
    std::memcpy(array.data(), arrays.data(), array.size_bytes());
    arrays = arrays.subspan(array.size_bytes());
  });
  return inverse;
}

tl::expected<void, std::string> saveInverse(const fs::path& path, const Inverse& inverse) {
  Header header;
  header.coordinateCount = inverse.coordinateCount();
  header.forceCount = inverse.forceCount();
  header.rank = inverse.rank();
  header.id = inverse.id;
  header.computed_ns = inverse.computed_ns;
  header.lambda = inverse.lambda;
  header.systematicErrors = inverse.systematicErrors.contact.size();
  std::vector<char> file(sizeof header);
  forEachArray(inverse, [&file](auto array) {
    const char* const bytes = reinterpret_cast<const char*>(array.data());
    file.insert(file.end(), bytes, bytes + array.size_bytes());
  });
  header.checksum = checksum(header, std::span<const char>(file).subspan(sizeof header));
  std::memcpy(file.data(), &header, sizeof header);
  if (const auto error = replaceWholeFile(path, file)) return tl::unexpected(path.string() + ": " + error.message());
  return {};
}

}  // namespace tractiond::solve
