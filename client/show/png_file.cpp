#include "client/show/png_file.h"

#include "client/show/output.h"

#include <png.h>

#include <cstring>

namespace traction::client {

void writePng(const std::string& path, std::uint32_t width, std::uint32_t height, std::uint32_t channels,
              const std::uint8_t* levels) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  if (png_image_write_to_file(&image, path.c_str(), 0, levels, 0, nullptr) == 0) {
    throw OutputError("cannot write " + path + ": " + image.message);
  }
}

}  // namespace traction::client
