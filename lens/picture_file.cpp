#include "lens/picture_file.h"

#include "base/whole_file.h"

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

namespace lens {

namespace {

using tractiond::Error;
using namespace std::string_view_literals;

constexpr std::uint32_t kLargestSide = 16384;        // px, the same limit as in the gel file
constexpr std::uint64_t kMost_bytes = 512ULL << 20;  // more than the largest cameras send
constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n"sv, kJpeg = "\xff\xd8\xff"sv;

/// How large a file says it is, before anything of it is decoded: a file of some bytes may say anything.
struct PictureHeader {
  std::uint32_t width = 0, height = 0;  ///< px
  std::uint64_t decoded_bytes = 0;      ///< of all its samples; of a TIFF's tile if that is larger
};

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

/// Returns the header of a PNG, JPEG or TIFF file. On failure returns what is wrong, as the end of a sentence about the
/// file: another type, or a header that is damaged or cut off. Checks nothing beyond the header.
Header headerOf(std::string_view file) {
  if (file.empty()) return tl::unexpected(std::string("is empty"));
  Header found = tl::unexpected(std::string("is no PNG, TIFF or JPEG picture"));
  if (file.starts_with(kPng)) found = ofPng(file);
  if (file.starts_with(kJpeg)) found = ofJpeg(file);
  if (file.starts_with("II*\0"sv)) found = ofTiff(file, false);
  if (file.starts_with("MM\0*"sv)) found = ofTiff(file, true);
  if (found && (found->width == 0 || found->height == 0)) {
    return tl::unexpected(std::string("is damaged: its header has no size"));
  }
  return found;
}

/// Returns the fault of a PNG file, or an empty text if length, type, data and checksum of every chunk up to the last
/// are right. Decoders tolerate some missing data and leave grey areas.
/// \param each is called with type and data of each chunk
std::string faultOfPng(std::string_view text, auto each) {
  const Bytes bytes(text, true);
  std::size_t at = kPng.size();
  while (text.size() - at >= 12) {
    const std::size_t length = *bytes.at(at, 4);
    if (text.size() - at - 12 < length) break;
    const std::string_view covered = text.substr(at + 4, length + 4);
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>(covered.data()), static_cast<uInt>(covered.size()));
    if (sum != *bytes.at(at + 8 + length, 4)) return "is damaged: a check sum of the PNG does not fit";
    each(covered);
    at += length + 12;
    if (covered.starts_with("IEND")) return "";
  }
  return "is cut off: the PNG ends after " + std::to_string(text.size()) + " bytes, before its last chunk";
}

/// Returns the fault of a file that nothing has been decoded of, or an empty text.
std::string faultOf(std::string_view text, const PictureHeader& header) {
  if (header.width > kLargestSide || header.height > kLargestSide) return "is larger than 16384 px";
  if (header.decoded_bytes > kMost_bytes) {
    return "would need " + std::to_string(header.decoded_bytes >> 20) + " MiB of memory, and at most " +
           std::to_string(kMost_bytes >> 20) + " are used: save it with 8 bits per channel, or take a region";
  }
  if (text.starts_with(kPng)) return faultOfPng(text, [](std::string_view) {});
  if (text.starts_with(kJpeg) && !text.ends_with("\xff\xd9"sv)) {
    return "is cut off: the JPEG does not end as one does";
  }
  return "";
}

}  // namespace

tl::expected<cv::Mat, Error> readPicture(const std::string& path, cv::Size expected) {
  const auto bytes = tractiond::readWholeFile(path);
  if (!bytes) {
    return tl::unexpected(
        Error{.exitCode = EX_NOINPUT, .what = "cannot be read: " + bytes.error().message(), .where = path});
  }
  const auto damaged = [&](std::string what) {
    return tl::unexpected(Error{.exitCode = EX_DATAERR, .what = std::move(what), .where = path});
  };
  const std::string_view text(bytes->data(), bytes->size());
  const Header header = headerOf(text);
  if (!header) return damaged(header.error());
  if (std::string what = faultOf(text, *header); !what.empty()) return damaged(std::move(what));
  if (!expected.empty() && expected != cv::Size(static_cast<int>(header->width), static_cast<int>(header->height))) {
    return tl::unexpected(Error{.exitCode = EX_DATAERR,
                                .what = "has " + std::to_string(header->width) + " x " +
                                        std::to_string(header->height) + " px, the gel file's camera " +
                                        std::to_string(expected.width) + " x " + std::to_string(expected.height),
                                .where = path,
                                .remedy = "take the picture at that size, or write its size into the gel file"});
  }
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // it would repeat our error on standard error
  cv::Mat picture;
  try {
    picture = cv::imdecode(*bytes, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) return damaged("is damaged or cut off: it cannot be decoded");
  if (picture.cols > int{kLargestSide} || picture.rows > int{kLargestSide}) return damaged("is larger than 16384 px");
  if (picture.channels() != 1 && picture.channels() != 3) return damaged("is neither grey nor coloured");
  if (picture.depth() != CV_8U) {
    double most = 0.0;
    cv::minMaxLoc(picture.reshape(1), nullptr, &most);
    picture.convertTo(picture, CV_8U, most > 0.0 ? 255.0 / most : 1.0);
  }
  return picture;
}

sensor::MeasuredWith measuredWith(const std::string& path) {
  constexpr std::string_view kKey = "tEXtmeasured_with\0"sv;
  sensor::MeasuredWith found;
  const auto bytes = tractiond::readWholeFile(path);
  if (!bytes || !std::string_view(bytes->data(), bytes->size()).starts_with(kPng)) return found;
  std::ignore = faultOfPng({bytes->data(), bytes->size()}, [&](std::string_view chunk) {
    if (chunk.starts_with(kKey)) found = sensor::MeasuredWith::parse(std::string(chunk.substr(kKey.size())));
  });
  return found;
}

cv::Mat grey(const cv::Mat& picture) {
  if (picture.channels() == 1) return picture;
  cv::Mat result;
  cv::cvtColor(picture, result, cv::COLOR_BGR2GRAY);
  return result;
}

tl::expected<void, Error> writePicture(const std::string& path, const cv::Mat& picture) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", picture, bytes);
  const std::error_code failed =
      tractiond::replaceWholeFile(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!failed) return {};
  return tl::unexpected(
      Error{.exitCode = EX_CANTCREAT, .what = "cannot be written: " + failed.message(), .where = path});
}

}  // namespace lens
