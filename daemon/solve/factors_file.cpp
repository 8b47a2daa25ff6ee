// The file: a header with sizes and a checksum of itself and all that follows, then the arrays as they are in memory.
// It is read, not mapped, so a file that is cut short while the daemon runs does no harm, and checked before any of it
// is used.
#include "daemon/solve/factors_file.h"

#include "base/hash.h"
#include "base/whole_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

using Magic = std::array<char, 8>;

constexpr Magic kMagic = {'t', 'r', 'a', 'c', 't', 'f', 'a', 'c'};
/// To be raised when the layout changes.
constexpr std::uint32_t kFormatVersion = 3;

/// In the machine's byte order: another order's version would not be known.
struct Header {
  Magic magic{};
  std::uint32_t formatVersion = 0;
  std::int32_t coordinateCount = 0;
  std::int32_t forceCount = 0;
  std::int32_t rank = 0;
  Id id{};
  std::int64_t computed_ns = 0;
  double force_N = 0.0;
  double displacementError = 0.0;
  std::uint64_t systematicErrors = 0;  ///< numbers in either array
  std::uint64_t scatter = 0;           ///< the same, of what markers' depths misread
  Hash128 checksum{};                  ///< of the header up to here, then of all that follows
};
static_assert(sizeof(Header) == 96);  // no padding
constexpr std::size_t kCheckedHeader = offsetof(Header, checksum);

template <typename Matrix>
auto all(Matrix& matrix) {
  return std::span(matrix.data(), static_cast<std::size_t>(matrix.size()));
}

/// Calls `use` with each array's memory in the file's order.
template <typename OfFactors, typename Use>
void forEachArray(OfFactors& factors, Use use) {
  use(std::span(factors.singularValues));
  use(factors.left.all());
  use(factors.right.all());
  use(all(factors.motionGain));
  use(all(factors.motionCoupling));
  use(all(factors.motionGram));
  use(factors.influence.all());
  use(std::span(factors.gram));
  use(factors.motion.all());
  use(std::span(factors.systematicErrors.contact));
  use(std::span(factors.systematicErrors.wholeFace));
  use(std::span(factors.systematicErrors.contactScatter));
  use(std::span(factors.systematicErrors.wholeFaceScatter));
}

Hash128 checksum(const Header& header, std::span<const char> arrays) {
  Hasher hasher;
  hasher.bytes(&header, kCheckedHeader);
  hasher.bytes(arrays.data(), arrays.size());
  return hasher.digest();
}

/// Sizes the arrays as the header says, for so many atoms.
void resize(Factors& factors, const Header& header, int atomCount) {
  const auto atoms = static_cast<std::size_t>(atomCount);
  factors.singularValues.resize(static_cast<std::size_t>(header.rank));
  factors.left = RowMatrix(header.coordinateCount, header.rank + kMotions);
  factors.right = RowMatrix(header.forceCount, header.rank);
  factors.influence = RowMatrix(3 * atomCount, header.coordinateCount);
  factors.gram.resize(9 * atoms * (atoms + 1) / 2);
  factors.motion = RowMatrix(kMotions, header.coordinateCount);
  factors.motionCoupling.resize(Eigen::NoChange, 3 * atomCount);
  factors.systematicErrors.contact.resize(header.systematicErrors);
  factors.systematicErrors.wholeFace.resize(header.systematicErrors);
  factors.systematicErrors.contactScatter.resize(header.scatter);
  factors.systematicErrors.wholeFaceScatter.resize(header.scatter);
}

}  // namespace

tl::expected<Factors, std::string> loadFactors(const fs::path& path, const Id& id, int coordinateCount,
                                               const Atoms& atoms) {
  const auto reject = [&path](const std::string& reason) { return tl::unexpected(path.string() + ": " + reason); };
  const auto file = readWholeFile(path);
  if (!file) return reject(file.error().message());

  Header header;
  if (file->size() < sizeof header) return reject("shorter than its header");
  std::memcpy(&header, file->data(), sizeof header);
  if (header.magic != kMagic) return reject("not a file of factors");
  if (header.formatVersion != kFormatVersion) return reject("written by another version");
  if (header.id != id) return reject("of another sensor");
  const int forceCount = 3 * atoms.pointCount();
  auto arrays = std::span<const char>(*file).subspan(sizeof header);
  if (header.checksum != checksum(header, arrays)) return reject("its checksum is wrong");
  if (header.coordinateCount != coordinateCount || header.forceCount != forceCount || header.rank < 1 ||
      header.rank > std::min(coordinateCount, forceCount) || header.systematicErrors % 36 != 0 ||
      header.systematicErrors > arrays.size() || header.scatter % 18 != 0 || header.scatter > arrays.size()) {
    return reject("of another size");
  }

  Factors factors;
  factors.id = header.id;
  factors.computed_ns = header.computed_ns;
  factors.force_N = header.force_N;
  factors.systematicErrors.displacement = header.displacementError;
  resize(factors, header, atoms.count());
  std::size_t size = 0;
  forEachArray(factors, [&size](auto array) { size += array.size_bytes(); });
  if (arrays.size() != size) return reject("of another size");
  forEachArray(factors, [&arrays](auto array) {
    if (!array.empty()) std::memcpy(array.data(), arrays.data(), array.size_bytes());
    arrays = arrays.subspan(array.size_bytes());
  });
  return factors;
}

tl::expected<void, std::string> saveFactors(const fs::path& path, const Factors& factors) {
  Header header;
  header.magic = kMagic;
  header.formatVersion = kFormatVersion;
  header.coordinateCount = factors.coordinateCount();
  header.forceCount = 3 * factors.pointCount();
  header.rank = factors.rank();
  header.id = factors.id;
  header.computed_ns = factors.computed_ns;
  header.force_N = factors.force_N;
  header.displacementError = factors.systematicErrors.displacement;
  header.systematicErrors = factors.systematicErrors.contact.size();
  header.scatter = factors.systematicErrors.contactScatter.size();
  std::vector<char> file(sizeof header);
  forEachArray(factors, [&file](auto array) {
    const char* const bytes = reinterpret_cast<const char*>(array.data());
    file.insert(file.end(), bytes, bytes + array.size_bytes());
  });
  header.checksum = checksum(header, std::span<const char>(file).subspan(sizeof header));
  std::memcpy(file.data(), &header, sizeof header);
  if (const auto error = replaceWholeFile(path, file)) return tl::unexpected(path.string() + ": " + error.message());
  return {};
}

}  // namespace tractiond::solve
