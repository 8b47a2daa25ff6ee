// The file: a header with sizes and a checksum of itself and all that follows, then the arrays as they are in memory.
// It is read, not mapped, so a file that is cut short while the daemon runs does no harm, and checked before any of it
// is used.
#include "daemon/solve/inverse_file.h"

#include "base/hash.h"
#include "base/whole_file.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace tractiond::solve {
namespace {

namespace fs = std::filesystem;

using Magic = std::array<char, 8>;

/// What differs between the two kinds of content. The versions are to be raised when a file's layout changes.
template <typename Content>
struct Kind;
template <>
struct Kind<Inverse> {
  static constexpr Magic kMagic = {'t', 'r', 'a', 'c', 't', 'i', 'n', 'v'};
  static constexpr std::uint32_t kFormatVersion = 4;
};
template <>
struct Kind<Factors> {
  static constexpr Magic kMagic = {'t', 'r', 'a', 'c', 't', 'f', 'a', 'c'};
  static constexpr std::uint32_t kFormatVersion = 2;
};

/// In the machine's byte order: another order's version would not be known.
struct Header {
  Magic magic{};
  std::uint32_t formatVersion = 0;
  std::int32_t coordinateCount = 0;
  std::int32_t forceCount = 0;
  std::int32_t rank = 0;
  Id id{};
  std::int64_t computed_ns = 0;
  double scale = 0.0;                  ///< Inverse::lambda or Factors::force_N
  std::uint64_t systematicErrors = 0;  ///< numbers in either array
  std::uint64_t scatter = 0;           ///< the same, of what markers' depths misread
  Hash128 checksum{};                  ///< of the header up to here, then of all that follows
};
static_assert(sizeof(Header) == 88);  // no padding
constexpr std::size_t kCheckedHeader = offsetof(Header, checksum);

template <typename Matrix>
auto all(Matrix& matrix) {
  return std::span(matrix.data(), static_cast<std::size_t>(matrix.size()));
}

/// Calls `use` with each array's memory in the file's order.
template <typename Content, typename Use>
void forEachArray(Content& content, Use use) {
  use(std::span(content.singularValues));
  use(content.left.all());
  use(content.right.all());
  use(all(content.motionGain));
  if constexpr (std::is_same_v<std::remove_const_t<Content>, Inverse>) {
    use(std::span(content.motionVariance));
    use(std::span(content.hat));
  } else {
    use(all(content.motionCoupling));
    use(all(content.motionGram));
  }
  use(content.influence.all());
  use(std::span(content.gram));
  use(content.motion.all());
  use(std::span(content.systematicErrors.contact));
  use(std::span(content.systematicErrors.wholeFace));
  use(std::span(content.systematicErrors.contactScatter));
  use(std::span(content.systematicErrors.wholeFaceScatter));
}

Hash128 checksum(const Header& header, std::span<const char> arrays) {
  Hasher hasher;
  hasher.bytes(&header, kCheckedHeader);
  hasher.bytes(arrays.data(), arrays.size());
  return hasher.digest();
}

/// Sizes the arrays that both have.
template <typename Content>
void resizeCommon(Content& content, const Header& header) {
  content.singularValues.resize(static_cast<std::size_t>(header.rank));
  content.left = RowMatrix(header.coordinateCount, header.rank + kMotions);
  content.motion = RowMatrix(kMotions, header.coordinateCount);
  content.systematicErrors.contact.resize(header.systematicErrors);
  content.systematicErrors.wholeFace.resize(header.systematicErrors);
  content.systematicErrors.contactScatter.resize(header.scatter);
  content.systematicErrors.wholeFaceScatter.resize(header.scatter);
}

/// Sizes the arrays as the header says.
void resize(Inverse& inverse, const Header& header) {
  const auto coordinates = static_cast<std::size_t>(header.coordinateCount);
  const auto forces = static_cast<std::size_t>(header.forceCount);
  resizeCommon(inverse, header);
  inverse.lambda = header.scale;
  inverse.right = RowMatrix(header.rank, header.forceCount);
  inverse.motionGain.resize(kMotions);
  inverse.motionVariance.resize(kMotions);
  inverse.hat.resize(coordinates * (coordinates + 1) / 2);
  inverse.influence = RowMatrix(header.forceCount, header.coordinateCount);
  inverse.gram.resize(forces * (forces + 1) / 2);
}

/// The same, for so many atoms.
void resize(Factors& factors, const Header& header, int atomCount) {
  const auto atoms = static_cast<std::size_t>(atomCount);
  resizeCommon(factors, header);
  factors.force_N = header.scale;
  factors.right = RowMatrix(header.forceCount, header.rank);
  factors.influence = RowMatrix(3 * atomCount, header.coordinateCount);
  factors.gram.resize(9 * atoms * (atoms + 1) / 2);
  factors.motionCoupling.resize(Eigen::NoChange, 3 * atomCount);
}

/// `resizeAs(content, header)` sizes the arrays.
template <typename Content, typename Resize>
tl::expected<Content, std::string> load(const fs::path& path, const Id& id, int coordinateCount, int forceCount,
                                        Resize resizeAs) {
  const auto reject = [&path](const std::string& reason) { return tl::unexpected(path.string() + ": " + reason); };
  const auto file = readWholeFile(path);
  if (!file) return reject(file.error().message());

  Header header;
  if (file->size() < sizeof header) return reject("shorter than its header");
  std::memcpy(&header, file->data(), sizeof header);
  if (header.magic != Kind<Content>::kMagic) return reject("not a cached inverse");
  if (header.formatVersion != Kind<Content>::kFormatVersion) return reject("written by another version");
  if (header.id != id) return reject("of another sensor");
  auto arrays = std::span<const char>(*file).subspan(sizeof header);
  if (header.checksum != checksum(header, arrays)) return reject("its checksum is wrong");
  if (header.coordinateCount != coordinateCount || header.forceCount != forceCount || header.rank < 1 ||
      header.rank > std::min(coordinateCount, forceCount) || header.systematicErrors % 36 != 0 ||
      header.systematicErrors > arrays.size() || header.scatter % 18 != 0 || header.scatter > arrays.size()) {
    return reject("of another size");
  }

  Content content;
  content.id = header.id;
  content.computed_ns = header.computed_ns;
  resizeAs(content, header);
  std::size_t size = 0;
  forEachArray(content, [&size](auto array) { size += array.size_bytes(); });
  if (arrays.size() != size) return reject("of another size");
  forEachArray(content, [&arrays](auto array) {
    if (!array.empty()) std::memcpy(array.data(), arrays.data(), array.size_bytes());
    arrays = arrays.subspan(array.size_bytes());
  });
  return content;
}

template <typename Content>
tl::expected<void, std::string> save(const fs::path& path, const Content& content, int forceCount, double scale) {
  Header header;
  header.magic = Kind<Content>::kMagic;
  header.formatVersion = Kind<Content>::kFormatVersion;
  header.coordinateCount = content.coordinateCount();
  header.forceCount = forceCount;
  header.rank = content.rank();
  header.id = content.id;
  header.computed_ns = content.computed_ns;
  header.scale = scale;
  header.systematicErrors = content.systematicErrors.contact.size();
  header.scatter = content.systematicErrors.contactScatter.size();
  std::vector<char> file(sizeof header);
  forEachArray(content, [&file](auto array) {
    const char* const bytes = reinterpret_cast<const char*>(array.data());
    file.insert(file.end(), bytes, bytes + array.size_bytes());
  });
  header.checksum = checksum(header, std::span<const char>(file).subspan(sizeof header));
  std::memcpy(file.data(), &header, sizeof header);
  if (const auto error = replaceWholeFile(path, file)) return tl::unexpected(path.string() + ": " + error.message());
  return {};
}

}  // namespace

tl::expected<Inverse, std::string> loadInverse(const fs::path& path, const Id& id, int coordinateCount,
                                               int forceCount) {
  return load<Inverse>(path, id, coordinateCount, forceCount,
                       [](Inverse& inverse, const Header& header) { resize(inverse, header); });
}

tl::expected<Factors, std::string> loadFactors(const fs::path& path, const Id& id, int coordinateCount,
                                               const Atoms& atoms) {
  return load<Factors>(path, id, coordinateCount, 3 * atoms.pointCount(),
                       [&atoms](Factors& factors, const Header& header) { resize(factors, header, atoms.count()); });
}

tl::expected<void, std::string> saveInverse(const fs::path& path, const Inverse& inverse) {
  return save(path, inverse, inverse.forceCount(), inverse.lambda);
}

tl::expected<void, std::string> saveFactors(const fs::path& path, const Factors& factors) {
  return save(path, factors, 3 * factors.pointCount(), factors.force_N);
}

}  // namespace tractiond::solve
