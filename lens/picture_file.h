// Reads and writes picture files. Exceptions of a decoder become errors here.
#pragma once

#include "base/error.h"
#include "sensor/measured_with.h"

#include <opencv2/core.hpp>
#include <tl/expected.hpp>

#include <string>

namespace lens {

/// Reads a PNG, TIFF or JPEG picture as 8 bits, grey or BGR, without applying a JPEG's orientation. Deeper samples are
/// scaled so that the brightest becomes 255. The error names the file: EX_NOINPUT if it cannot be read, EX_DATAERR if
/// it is damaged, of another type, has a side above 16384 px or would need more than 512 MiB of memory, or is not of
/// the expected size, all of which its header tells before anything is decoded. Damage inside a JPEG or TIFF may stay
/// undetected. Turns off OpenCV's log in this process. Reentrant.
/// \param expected that of the gel file's camera; empty: any
tl::expected<cv::Mat, tractiond::Error> readPicture(const std::string& path, cv::Size expected = {});

/// Returns what a picture of tractionctl or traction-view says of its camera; nothing is known of other pictures, and
/// of files that cannot be read. Reentrant.
sensor::MeasuredWith measuredWith(const std::string& path);

/// Converts a BGR picture to grey, of the same depth. A grey picture is returned unchanged and shares its memory.
cv::Mat grey(const cv::Mat& picture);

/// Writes a PNG file atomically; an existing file is replaced. Error: EX_CANTCREAT, with the file's name.
/// \param picture 8 bits, grey or BGR, not empty
tl::expected<void, tractiond::Error> writePicture(const std::string& path, const cv::Mat& picture);

}  // namespace lens
