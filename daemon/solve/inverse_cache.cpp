// The file: a header with sizes and a checksum of itself and all that follows, then the inverse's four arrays as they
// are in memory. It is read, not mapped, so a file that is cut short while we run does us no harm, and checked before
// any of it is used.
#include "daemon/solve/inverse_cache.h"

#include "daemon/base/clock.h"
#include "daemon/base/hash.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <system_error>
#include <utility>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

/// To be raised when the influence matrix's or the inverse's numbers change for the same sensor and options.
constexpr std::uint32_t kAlgorithmVersion = 1;

/// To be raised when the file's layout changes.
constexpr std::uint32_t kFormatVersion = 1;
constexpr std::array<char, 8> kMagic = {'t', 'r', 'a', 'c', 't', 'i', 'n', 'v'};

constexpr std::size_t kKeptOthers = 3;
constexpr const char* kExtension = ".inverse";
constexpr const char* kUnfinished = ".unfinished";  // added to the name while the file is written

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
  Hash128 checksum{};  ///< of the header up to here, then of all that follows
};
static_assert(sizeof(Header) == 72);  // no padding
constexpr std::size_t kCheckedHeader = offsetof(Header, checksum);

/// Calls `use` with each array's memory in the file's order, as long as it succeeds.
template <typename AnInverse, typename Use>
bool forEachArray(AnInverse& inverse, Use use) {
  return use(std::span(inverse.singularValues)) && use(inverse.left.all()) && use(inverse.right.all()) &&
         use(std::span(inverse.hat));
}

/// Closes its file.
class Descriptor {
 public:
  explicit Descriptor(int number)
      : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) close(number_);
  }
  int number() const { return number_; }

 private:
  int number_;
};

std::string systemError() {
  return std::generic_category().message(errno);
}

bool readAll(int file, void* data, std::size_t size) {
  auto* at = static_cast<std::byte*>(data);
  while (size > 0) {
    const ssize_t count = read(file, at, size);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    at += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

bool writeAll(int file, const void* data, std::size_t size) {
  const auto* at = static_cast<const std::byte*>(data);
  while (size > 0) {
    const ssize_t count = write(file, at, size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return false;
    at += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

Hasher headerHasher(const Header& header) {
  Hasher hasher;
  hasher.bytes(&header, kCheckedHeader);
  return hasher;
}

void resize(Inverse& inverse, const Header& header) {
  const auto coordinates = static_cast<std::size_t>(header.coordinateCount);
  inverse.singularValues.resize(static_cast<std::size_t>(header.rank));
  inverse.left = RowMatrix(header.coordinateCount, header.rank);
  inverse.right = RowMatrix(header.rank, header.forceCount);
  inverse.hat.resize(coordinates * (coordinates + 1) / 2);
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
  hasher.value(sensor.gel.youngsModulus);
  hasher.value(sensor.gel.poissonRatio);
  vector(sensor.gel.size);
  vector(sensor::markerPositions(sensor.layers));
  vector(sensor::nodePositions(sensor.nodes));
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
  say("computing the inverse: " + cached.error());

  constexpr double kInfluenceShare = 0.7;  // of the time
  const auto part = [&progress](double start, double share) -> sensor::elastic::Progress {
    if (!progress) return {};
    return [&progress, start, share](double fraction) { progress(start + share * fraction); };
  };
  const Eigen::MatrixXd influence = sensor::elastic::influenceMatrix(sensor, options.model, part(0.0, kInfluenceShare));
  auto inverse = computeInverse(influence, options, part(kInfluenceShare, 1.0 - kInfluenceShare));
  if (!inverse) return inverse;
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
  const Descriptor file(open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) return reject(systemError());

  Header header;
  if (!readAll(file.number(), &header, sizeof header)) return reject("shorter than its header");
  if (header.magic != kMagic) return reject("not a cached inverse");
  if (header.formatVersion != kFormatVersion) return reject("written by another version");
  if (header.id != id) return reject("of another sensor");
  if (header.coordinateCount != coordinateCount || header.forceCount != forceCount || header.rank < 1 ||
      header.rank > std::min(coordinateCount, forceCount)) {
    return reject("of another size");
  }

  Inverse inverse;
  inverse.id = header.id;
  inverse.computed_ns = header.computed_ns;
  inverse.lambda = header.lambda;
  resize(inverse, header);
  Hasher hasher = headerHasher(header);
  const bool whole = forEachArray(inverse, [&](auto array) {
    if (!readAll(file.number(), array.data(), array.size_bytes())) return false;
    hasher.bytes(array.data(), array.size_bytes());
    return true;
  });
  std::byte more{};
  if (!whole) return reject("cut short");
  if (readAll(file.number(), &more, 1)) return reject("longer than it should be");
  if (hasher.digest() != header.checksum) return reject("its checksum is wrong");
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
  Hasher hasher = headerHasher(header);
  forEachArray(inverse, [&hasher](auto array) {
    hasher.bytes(array.data(), array.size_bytes());
    return true;
  });
  header.checksum = hasher.digest();

  fs::path unfinished = path;
  unfinished += kUnfinished;
  const auto fail = [&unfinished](const fs::path& at) {
    std::string reason = at.string() + ": " + systemError();
    unlink(unfinished.c_str());
    return tl::unexpected(std::move(reason));
  };
  {
    const Descriptor file(open(unfinished.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (file.number() < 0) return fail(unfinished);
    const bool written = writeAll(file.number(), &header, sizeof header) && forEachArray(inverse, [&file](auto array) {
                           return writeAll(file.number(), array.data(), array.size_bytes());
                         });
    if (!written || fsync(file.number()) != 0) return fail(unfinished);
  }
  if (rename(unfinished.c_str(), path.c_str()) != 0) return fail(path);
  const Descriptor directory(open(path.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.number() >= 0) fsync(directory.number());  // the name; without it a power cut costs the cache, no more
  return {};
}

}  // namespace tractiond::solve
