#include "client/show/png_file.h"

#include "client/show/output.h"

#include <png.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace traction::client {

namespace {

void append(std::string& to, unsigned long number) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) to += static_cast<char>(number >> shift & 0xffU);
}

}  // namespace

void writePng(const std::string& path, std::uint32_t width, std::uint32_t height, std::uint32_t channels,
              const std::uint8_t* levels, const std::string& measuredWith) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = channels == 1 ? PNG_FORMAT_GRAY : PNG_FORMAT_RGB;
  std::string file(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = file.size();
  if (png_image_write_to_memory(&image, file.data(), &size, 0, levels, 0, nullptr) == 0) {
    throw OutputError("cannot write " + path + ": " + image.message);
  }
  file.resize(size);
  if (!measuredWith.empty()) {  // which this interface of libpng does not write
    constexpr std::size_t kFirstChunksEnd = 33;
    const std::string content = std::string("tEXtmeasured_with") + '\0' + measuredWith;
    std::string chunk;
    append(chunk, content.size() - 4);
    chunk += content;
    append(chunk, crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size())));
    file.insert(kFirstChunksEnd, chunk);
  }
  std::ofstream to(path, std::ios::binary);
  if (!(to << file << std::flush)) throw OutputError("cannot write " + path + ": " + std::strerror(errno));
}

}  // namespace traction::client
