// Pictures in files. What a damaged file does to a library's decoder stops here.
#pragma once

#include "daemon/base/error.h"

#include <opencv2/core.hpp>
#include <tl/expected.hpp>

#include <string>

namespace lens {

/// A PNG, TIFF or JPEG picture: 8 bits, grey or BGR, as the camera made it (no turning by what a JPEG says of itself).
/// More bits are scaled so that the brightest sample becomes 255. The error names the file. Reentrant.
tl::expected<cv::Mat, tractiond::Error> readPicture(const std::string& path);

/// The same in grey.
cv::Mat grey(const cv::Mat& picture);

/// PNG; all or nothing.
tl::expected<void, tractiond::Error> writePicture(const std::string& path, const cv::Mat& picture);

}  // namespace lens
