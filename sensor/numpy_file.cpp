// An archive is a zip file of stored members, found by the directory at its end. Each member is a .npy file: a magic
// number, a version, the text of a Python dictionary (type, order, shape), and the numbers. The file is untrusted:
// every offset and size is checked before it is used.
#include "sensor/numpy_file.h"

#include "base/whole_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace sensor {

namespace {

using Bytes = std::span<const char>;

constexpr std::uint32_t kLocalMember = 0x04034b50, kDirectoryMember = 0x02014b50, kDirectoryEnd = 0x06054b50;
constexpr std::size_t kLocalSize = 30, kDirectorySize = 46, kEndSize = 22;
constexpr std::uint32_t kElsewhere = 0xffffffff;  // marks a size or offset beyond 4 GiB, which an extension would hold
constexpr std::size_t kLargestFile = kElsewhere;
constexpr const char* kContradiction = "has a shape that its size contradicts";

/// Reads a little-endian number.
template <typename T>
T number(Bytes bytes, std::size_t at) {
  T value = 0;
  for (std::size_t i = sizeof(T); i-- > 0;) {
    value = static_cast<T>(value << 8 | static_cast<unsigned char>(bytes[at + i]));
  }
  return value;
}

bool holds(Bytes bytes, std::size_t at, std::size_t size) {
  return at <= bytes.size() && size <= bytes.size() - at;
}

/// Returns the text between `begin` and `end` after "'key':" in a dictionary.
std::optional<std::string_view> entry(std::string_view dictionary, std::string_view key, char begin, char end) {
  std::size_t at = dictionary.find(key);
  if (at == std::string_view::npos) return std::nullopt;
  at = dictionary.find_first_not_of(": ", at + key.size());
  if (at == std::string_view::npos || dictionary[at] != begin) return std::nullopt;
  const std::size_t stop = dictionary.find(end, ++at);
  if (stop == std::string_view::npos) return std::nullopt;
  return dictionary.substr(at, stop - at);
}

/// Parses "3, 4" or "3," or "".
std::optional<std::vector<std::size_t>> parseShape(std::string_view text) {
  std::vector<std::size_t> shape;
  while (!text.empty()) {
    std::size_t extent = 0;
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), extent);
    if (error != std::errc()) return std::nullopt;
    shape.push_back(extent);
    text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
    const std::size_t next = text.find_first_not_of(", ");
    text.remove_prefix(std::min(next, text.size()));
  }
  return shape;
}

std::string indices(std::size_t at, const std::vector<std::size_t>& shape) {
  std::string text;
  for (auto extent = shape.rbegin(); extent != shape.rend(); ++extent) {
    text = std::to_string(at % *extent) + (text.empty() ? "" : ", ") + text;
    at /= *extent;
  }
  return '[' + text + ']';
}

/// Returns the index in C order of the element at index `at` in Fortran order.
std::size_t fromFortran(std::size_t at, const std::vector<std::size_t>& shape) {
  std::size_t place = 0, stride = 1;
  for (const std::size_t extent : shape) stride *= extent;
  for (const std::size_t extent : shape) {
    stride /= extent;
    place += at % extent * stride;
    at /= extent;
  }
  return place;
}

}  // namespace

/// A parsed .npy file.
struct NumpyFile::Member {
  std::string type;  ///< "<f8"
  bool fortran = false;
  std::vector<std::size_t> shape;
  std::size_t count = 1;  ///< number of elements, each of `size` bytes
  std::size_t size = 0;
  Bytes data;
};

NumpyFile::NumpyFile(std::string path, std::vector<char> bytes)
    : path_(std::move(path))
    , bytes_(std::move(bytes)) {}

void NumpyFile::fail(const std::string& name, const std::string& what) {
  if (!fault_) fault_ = FileError{.where = path_, .what = (name.empty() ? "" : name + " ") + what, .isData = true};
}

tl::expected<void, FileError> NumpyFile::finish() const {
  if (fault_) return tl::unexpected(*fault_);
  return {};
}

tl::expected<NumpyFile, FileError> NumpyFile::load(const std::string& path) {
  auto bytes = tractiond::readWholeFile(path, kLargestFile);
  if (!bytes && bytes.error() != std::errc::file_too_large) {
    return tl::unexpected(FileError{.where = path, .what = bytes.error().message(), .unreadable = true});
  }
  NumpyFile file(path, std::move(bytes).value_or(std::vector<char>()));
  if (!bytes) file.fail("", "is larger than 4 GiB");
  file.readDirectory();
  if (file.fault_) return tl::unexpected(*file.fault_);
  return file;
}

void NumpyFile::readDirectory() {
  const Bytes bytes(bytes_);
  const std::size_t end = bytes.size() - std::min(bytes.size(), kEndSize);  // NumPy writes no comment behind it
  if (!holds(bytes, end, kEndSize) || number<std::uint32_t>(bytes, end) != kDirectoryEnd) {
    return fail("", "is no NumPy archive (.npz), or is cut short");
  }
  const auto count = number<std::uint16_t>(bytes, end + 10);
  std::size_t at = number<std::uint32_t>(bytes, end + 16);
  for (int i = 0; i < count; ++i) {
    if (!holds(bytes, at, kDirectorySize) || number<std::uint32_t>(bytes, at) != kDirectoryMember) {
      return fail("", "is damaged: its directory is no directory");
    }
    const auto method = number<std::uint16_t>(bytes, at + 10);
    const auto checksum = number<std::uint32_t>(bytes, at + 16);
    const auto size = number<std::uint32_t>(bytes, at + 24), local = number<std::uint32_t>(bytes, at + 42);
    const std::size_t nameSize = number<std::uint16_t>(bytes, at + 28);
    const std::size_t behind = nameSize + number<std::uint16_t>(bytes, at + 30) + number<std::uint16_t>(bytes, at + 32);
    if (!holds(bytes, at + kDirectorySize, behind)) return fail("", "is damaged: its directory is cut short");
    std::string name(bytes.data() + at + kDirectorySize, nameSize);
    at += kDirectorySize + behind;
    if (name.ends_with(".npy")) name.resize(name.size() - 4);

    if (method != 0) return fail(name, "is compressed: write the file with numpy.savez, not savez_compressed");
    if (size == kElsewhere || local == kElsewhere) return fail(name, "is larger than 4 GiB");
    if (!holds(bytes, local, kLocalSize) || number<std::uint32_t>(bytes, local) != kLocalMember) {
      return fail(name, "is not where the file's directory says: the file is damaged");
    }
    const std::size_t begin =
        local + kLocalSize + number<std::uint16_t>(bytes, local + 26) + number<std::uint16_t>(bytes, local + 28);
    if (!holds(bytes, begin, size)) return fail(name, "reaches beyond the file's end: it is cut short");
    const Bytes content = bytes.subspan(begin, size);
    if (crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()) != checksum) {
      return fail(name, "has a wrong checksum: the file is damaged");
    }
    if (!members_.emplace(name, content).second) return fail(name, "is there twice");
  }
}

std::optional<NumpyFile::Member> NumpyFile::member(const std::string& name) {
  const auto found = members_.find(name);
  const auto bad = [&](const std::string& what) {
    fail(name, what);
    return std::nullopt;
  };
  if (found == members_.end()) return bad("is missing");
  const Bytes bytes = found->second;
  constexpr std::string_view kMagic = "\x93NUMPY";
  constexpr std::size_t kVersionEnd = 8;
  if (!holds(bytes, 0, kVersionEnd + 4) || std::string_view(bytes.data(), kMagic.size()) != kMagic) {
    return bad("is no NumPy array");
  }
  if (bytes[6] != 1) return bad("is of an unknown version of NumPy's format");
  const std::size_t begin = kVersionEnd + 2, size = number<std::uint16_t>(bytes, kVersionEnd);
  if (!holds(bytes, begin, size)) return bad("is cut short in its header");

  const std::string_view dictionary(bytes.data() + begin, size);
  const auto type = entry(dictionary, "'descr'", '\'', '\'');
  const auto shape = entry(dictionary, "'shape'", '(', ')');
  if (!type) return bad("is no plain array: float64 or float32, or a string");
  const auto extents = shape ? parseShape(*shape) : std::nullopt;
  if (!extents) return bad("has no shape");
  Member member{.type = std::string(*type),
                .fortran = entry(dictionary, "'fortran_order'", 'T', 'e').has_value(),
                .shape = *extents,
                .data = bytes.subspan(begin + size)};
  if (type->size() > 2) std::from_chars(type->data() + 2, type->data() + type->size(), member.size);
  if (type->size() > 1 && (*type)[1] == 'U') member.size *= member.size < kElsewhere ? 4 : 0;  // UTF-32
  if (member.size == 0) return bad("is of type " + member.type + ": float64 or float32, or a string, is read");
  for (const std::size_t extent : member.shape) {
    if (extent == 0) return bad("is empty");
    if (member.count > member.data.size() / extent) return bad(kContradiction);
    member.count *= extent;
  }
  if (member.data.size() % member.size != 0 || member.data.size() / member.size != member.count) {
    return bad(kContradiction);
  }
  return member;
}

NumpyArray NumpyFile::numbers(const std::string& name) {
  const auto found = member(name);
  if (!found) return {};
  NumpyArray array{.shape = found->shape, .values = std::vector<double>(found->count)};
  const auto read = [&](auto example) {
    for (std::size_t i = 0; i < found->count; ++i) {
      decltype(example) value;
      std::memcpy(&value, found->data.data() + i * sizeof value, sizeof value);
      array.values[found->fortran ? fromFortran(i, array.shape) : i] = value;
    }
  };
  if (found->type == "<f8") {
    read(double{});
  } else if (found->type == "<f4") {
    read(float{});
  } else {
    fail(name, "is of type " + found->type + ": float64 or float32, little endian, is read");
  }
  for (std::size_t i = 0; i < array.values.size(); ++i) {
    if (std::isfinite(array.values[i])) continue;
    fail(name + indices(i, array.shape), std::isnan(array.values[i]) ? "is NaN" : "is infinite");
    break;
  }
  return array;
}

std::string NumpyFile::text(const std::string& name) {
  std::string text;
  const auto found = member(name);
  if (!found) return text;
  const bool isString = found->type.starts_with("<U") && found->count == 1;
  if (!isString) fail(name, "is no string");
  for (std::size_t i = 0; isString && i < found->data.size(); i += 4) {
    const auto code = number<std::uint32_t>(found->data, i);
    if (code == 0) break;
    if (code >= 0x7f) fail(name, "is no string");
    text += static_cast<char>(code);
  }
  return text;
}

}  // namespace sensor
