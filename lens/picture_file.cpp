#include "lens/picture_file.h"

#include "base/whole_file.h"
#include "lens/picture_header.h"

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <zlib.h>

#include <cstdint>
#include <string_view>
#include <vector>

namespace lens {

namespace {

using tractiond::Error;
using namespace std::string_view_literals;

constexpr std::uint32_t kLargestSide = 16384;        // px, the same limit as in the gel file
constexpr std::uint64_t kMost_bytes = 512ULL << 20;  // more than the largest cameras send
constexpr std::string_view kPng = "\x89PNG\r\n\x1a\n"sv;

std::uint32_t bigEndian(const char* bytes) {
  std::uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

/// Returns the fault of a PNG file, or an empty text if length, type, data and checksum of every chunk up to the last
/// are right. Decoders tolerate some missing data and leave grey areas.
std::string faultOfPng(std::string_view text) {
  std::size_t at = kPng.size();
  while (text.size() - at >= 12) {
    const std::size_t length = bigEndian(&text[at]);
    if (text.size() - at - 12 < length) break;
    const std::string_view covered = text.substr(at + 4, length + 4);
    const auto sum = crc32(0, reinterpret_cast<const Bytef*>(covered.data()), static_cast<uInt>(covered.size()));
    if (sum != bigEndian(&text[at + 8 + length])) return "is damaged: a check sum of the PNG does not fit";
    at += length + 12;
    if (covered.starts_with("IEND")) return "";
  }
  return "is cut off: the PNG ends after " + std::to_string(text.size()) + " bytes, before its last chunk";
}

/// Returns the fault of a file that nothing has been decoded of, or an empty text.
std::string faultOf(std::string_view text) {
  const auto header = headerOf(text);
  if (!header) return header.error();
  if (header->width > kLargestSide || header->height > kLargestSide) return "is larger than 16384 px";
  if (header->decoded_bytes > kMost_bytes) {
    return "would need " + std::to_string(header->decoded_bytes >> 20) + " MiB of memory, and at most " +
           std::to_string(kMost_bytes >> 20) + " are used: save it with 8 bits per channel, or take a region";
  }
  if (text.starts_with(kPng)) return faultOfPng(text);
  if (text.starts_with("\xff\xd8\xff"sv) && !text.ends_with("\xff\xd9"sv)) {
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
  if (std::string what = faultOf(text); !what.empty()) return damaged(std::move(what));
  if (const auto header = headerOf(text); !expected.empty() && (static_cast<int>(header->width) != expected.width ||
                                                                static_cast<int>(header->height) != expected.height)) {
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
