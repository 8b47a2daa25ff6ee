#include "lens/picture_file.h"

#include "base/whole_file.h"

#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <cstdint>
#include <string_view>
#include <vector>

namespace lens {

namespace {

using tractiond::Error;
using namespace std::string_view_literals;

constexpr int kLargestSide = 16384;  // px, the same limit as in the gel file

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
  if (text.empty()) return damaged("is empty");
  // Of all that decoders are given, they take this for whole, and leave grey in place of what is missing.
  if (text.starts_with("\xff\xd8\xff"sv) && !text.ends_with("\xff\xd9"sv)) {
    return damaged("is cut off: the JPEG does not end as one does");
  }
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // it would repeat our error on standard error
  cv::Mat picture;
  try {
    picture = cv::imdecode(*bytes, cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) return damaged("is no PNG, TIFF or JPEG picture, or damaged or cut off: it cannot be decoded");
  if (picture.cols > kLargestSide || picture.rows > kLargestSide) return damaged("is larger than 16384 px");
  if (!expected.empty() && picture.size() != expected) {
    return tl::unexpected(Error{.exitCode = EX_DATAERR,
                                .what = "has " + std::to_string(picture.cols) + " x " + std::to_string(picture.rows) +
                                        " px, the gel file's camera " + std::to_string(expected.width) + " x " +
                                        std::to_string(expected.height),
                                .where = path,
                                .remedy = "take the picture at that size, or write its size into the gel file"});
  }
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
