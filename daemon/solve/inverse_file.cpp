// The file: a header with sizes and a checksum of itself and all that follows, then the inverse's arrays as they are in
// memory. It is read, not mapped, so a file that is cut short while the daemon runs does no harm, and checked before
// any of it is used.
#include "daemon/solve/inverse_file.h"

#include "daemon/base/hash.h"
#include "daemon/base/whole_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

/// To be raised when the file's layout changes.
constexpr std::uint32_t kFormatVersion = 3;
constexpr std::array<char, 8> kMagic = {'t', 'r', 'a', 'c', 't', 'i', 'n', 'v'};

/// In the machine's byte order: another order's version would not be known.
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

}  // namespace

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
