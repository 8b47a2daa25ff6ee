#include "lens/picture_header.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace lens {

namespace {

using namespace std::string_view_literals;
using Header = tl::expected<PictureHeader, std::string>;

Header damaged(const char* type) {
  return tl::unexpected(std::string("is damaged or cut off: it has no complete ") + type + " header");
}

/// Numbers of a file in its byte order. Nothing beyond its end.
class Bytes {
 public:
  Bytes(std::string_view file, bool bigEndian)
      : file_(file)
      , bigEndian_(bigEndian) {}

  std::optional<std::uint32_t> at(std::size_t offset, std::size_t size) const {
    if (offset > file_.size() || file_.size() - offset < size) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      value = value << 8 | static_cast<unsigned char>(file_[offset + (bigEndian_ ? i : size - 1 - i)]);
    }
    return value;
  }

 private:
  std::string_view file_;
  bool bigEndian_;
};

PictureHeader header(std::uint32_t width, std::uint32_t height, std::uint32_t bits, std::uint32_t channels) {
  // Both are cut to what no picture has, so that the product does not overflow.
  const std::uint64_t bytes = std::uint64_t{std::min(bits, 64U) + 7} / 8 * std::min(channels, 64U);
  return {width, height,
          std::uint64_t{width} * height > std::numeric_limits<std::uint64_t>::max() / 1024
              ? std::numeric_limits<std::uint64_t>::max()
              : std::uint64_t{width} * height * bytes};
}

Header ofPng(std::string_view file) {
  const Bytes bytes(file, true);
  const auto width = bytes.at(16, 4), height = bytes.at(20, 4), bits = bytes.at(24, 1), colour = bytes.at(25, 1);
  if (!colour || file.substr(12, 4) != "IHDR") return damaged("PNG");
  const std::uint32_t channels = *colour == 0 ? 1 : *colour == 4 ? 2 : *colour == 6 ? 4 : 3;
  return header(*width, *height, *bits, channels);
}

Header ofJpeg(std::string_view file) {
  const Bytes bytes(file, true);
  for (std::size_t at = 2;;) {
    const auto begin = bytes.at(at, 1), marker = bytes.at(at + 1, 1);
    if (!marker || *begin != 0xff) return damaged("JPEG");
    if (*marker == 0xff) {  // padding
      ++at;
      continue;
    }
    at += 2;
    if (*marker == 0x01 || (*marker >= 0xd0 && *marker <= 0xd8)) continue;  // without a length
    const auto length = bytes.at(at, 2);
    if (!length || *length < 2 || *marker == 0xd9 || *marker == 0xda) return damaged("JPEG");
    const bool isFrame = *marker >= 0xc0 && *marker <= 0xcf && *marker != 0xc4 && *marker != 0xc8 && *marker != 0xcc;
    if (isFrame) {
      const auto bits = bytes.at(at + 2, 1), height = bytes.at(at + 3, 2), width = bytes.at(at + 5, 2),
                 channels = bytes.at(at + 7, 1);
      if (!channels) return damaged("JPEG");
      return header(*width, *height, *bits, *channels);
    }
    at += *length;
  }
}

Header ofTiff(std::string_view file, bool bigEndian) {
  const Bytes bytes(file, bigEndian);
  const auto directory = bytes.at(4, 4);
  const auto entries = directory ? bytes.at(*directory, 2) : std::nullopt;
  if (!entries) return damaged("TIFF");
  std::uint32_t width = 0, height = 0, bits = 1, channels = 1, tileWidth = 0, tileHeight = 0;
  for (std::uint32_t i = 0; i < *entries; ++i) {
    const std::size_t entry = std::size_t{*directory} + 2 + 12 * std::size_t{i};
    const auto tag = bytes.at(entry, 2), type = bytes.at(entry + 2, 2), count = bytes.at(entry + 4, 4);
    if (!count) return damaged("TIFF");
    const std::size_t size = *type == 3 ? 2 : *type == 1 ? 1 : 4;
    // Several numbers stand elsewhere in the file if they need more than four bytes.
    std::size_t place = entry + 8;
    if (std::uint64_t{*count} * size > 4)
      place = bytes.at(place, 4).value_or(std::numeric_limits<std::uint32_t>::max());
    const auto value = bytes.at(place, size);
    const auto raise = [&](std::uint32_t& number) { number = std::max(number, value.value_or(0)); };
    switch (*tag) {
    case 256:
      raise(width);
      break;
    case 257:
      raise(height);
      break;
    case 258:
      raise(bits);
      break;
    case 277:
      raise(channels);
      break;
    case 322:
      raise(tileWidth);
      break;
    case 323:
      raise(tileHeight);
      break;
    default:
      break;
    }
  }
  PictureHeader found = header(width, height, bits, channels);
  found.decoded_bytes = std::max(found.decoded_bytes, header(tileWidth, tileHeight, bits, channels).decoded_bytes);
  return found;
}

}  // namespace

Header headerOf(std::string_view file) {
  if (file.empty()) return tl::unexpected(std::string("is empty"));
  Header found = tl::unexpected(std::string("is no PNG, TIFF or JPEG picture"));
  if (file.starts_with("\x89PNG\r\n\x1a\n"sv)) found = ofPng(file);
  if (file.starts_with("\xff\xd8\xff"sv)) found = ofJpeg(file);
  if (file.starts_with("II*\0"sv)) found = ofTiff(file, false);
  if (file.starts_with("MM\0*"sv)) found = ofTiff(file, true);
  if (found && (found->width == 0 || found->height == 0)) {
    return tl::unexpected(std::string("is damaged: its header has no size"));
  }
  return found;
}

}  // namespace lens
