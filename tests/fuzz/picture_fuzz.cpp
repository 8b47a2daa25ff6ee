#include "lens/picture_file.h"
#include "tests/fuzz/target.h"

#include <opencv2/imgcodecs.hpp>

namespace fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> all;
  cv::Mat picture(16, 24, CV_8UC3);
  cv::randu(picture, 0, 255);
  for (const char* kind : {".png", ".tiff", ".jpg"}) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(kind, picture, bytes);
    all.emplace_back(bytes.begin(), bytes.end());
  }
  return all;
}

bool feed(std::string_view bytes) {
  const MemoryFile file(bytes);
  return lens::readPicture(file.path()).has_value();
}

}  // namespace fuzz
