// The file: a header with sizes and a checksum of itself and all that follows, then the arrays as they are in memory.
// It is read into them, not mapped, so a file that is cut short while the daemon runs does no harm, and checked before
// any of it is used.
#include "daemon/solve/factors_file.h"

#include "base/hash.h"
#include "base/whole_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

using Magic = std::array<char, 8>;

constexpr Magic kMagic = {'t', 'r', 'a', 'c', 't', 'f', 'a', 'c'};
/// To be raised when the layout changes.
constexpr std::uint32_t kFormatVersion = 4;

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
  return std::span(matrix.data(), matrix.size());
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
  use(std::span(factors.systematicErrors.contactHeat));
  use(std::span(factors.systematicErrors.wholeFaceHeat));
}

Hash128 checksum(const Header& header, const Factors& factors) {
  Hasher hasher;
  hasher.bytes(&header, kCheckedHeader);
  forEachArray(factors, [&hasher](auto array) { hasher.bytes(array.data(), array.size_bytes()); });
  return hasher.digest();
}

/// Sizes the arrays as the header says, for so many atoms.
void resize(Factors& factors, const Header& header, int atomCount) {
  const auto atoms = static_cast<std::size_t>(atomCount);
  factors.singularValues.resize(header.rank);
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

/// Reads as many bytes as the span has. Returns false if the file ends before, or cannot be read.
bool fill(const OpenFile& file, std::span<char> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = file.read(bytes.data(), bytes.size());
    if (count <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

/// Returns whether the header's sizes are possible for this sensor: memory is taken for the arrays before the checksum
/// can be known.
bool fits(const Header& header, int coordinateCount, const Atoms& atoms) {
  constexpr std::uint64_t kMost = 64;  // matrices of systematic errors
  return header.coordinateCount == coordinateCount && header.forceCount == 3 * atoms.pointCount() && header.rank >= 1 &&
         header.rank <= std::min(header.coordinateCount, header.forceCount) && header.systematicErrors % 36 == 0 &&
         header.systematicErrors <= 36 * kMost && header.scatter % 18 == 0 && header.scatter <= 18 * kMost;
}

}  // namespace

tl::expected<Factors, std::string> loadFactors(const fs::path& path, const Id& id, int coordinateCount,
                                               const Atoms& atoms) {
  const auto reject = [&path](const std::string& reason) { return tl::unexpected(path.string() + ": " + reason); };
  const auto file = openRegularFile(path);
  if (!file) return reject(file.error().message());
  Header header;
  if (!fill(*file, {reinterpret_cast<char*>(&header), sizeof header})) return reject("shorter than its header");
  if (header.magic != kMagic) return reject("not a file of factors");
  if (header.formatVersion != kFormatVersion) return reject("written by another version");
  if (header.id != id) return reject("of another sensor");
  if (!fits(header, coordinateCount, atoms)) return reject("of another size");

  Factors factors;
  factors.id = header.id;
  factors.computed_ns = header.computed_ns;
  factors.force_N = header.force_N;
  factors.systematicErrors.displacement = header.displacementError;
  resize(factors, header, atoms.count());
  bool whole = true;
  forEachArray(factors, [&](auto array) {
    whole = whole && fill(*file, {reinterpret_cast<char*>(array.data()), array.size_bytes()});
  });
  char more = 0;
  if (!whole || fill(*file, {&more, 1}) || header.checksum != checksum(header, factors)) {
    return reject("its checksum is wrong");
  }
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
  header.checksum = checksum(header, factors);
  std::vector<std::span<const char>> pieces = {{reinterpret_cast<const char*>(&header), sizeof header}};
  forEachArray(factors, [&pieces](auto array) {
    pieces.emplace_back(reinterpret_cast<const char*>(array.data()), array.size_bytes());
  });
  if (const auto error = replaceWholeFile(path, pieces)) return tl::unexpected(path.string() + ": " + error.message());
  return {};
}

}  // namespace tractiond::solve
