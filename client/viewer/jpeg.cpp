#include "client/viewer/jpeg.h"

#include <turbojpeg.h>

namespace traction::view {

std::string jpegOf(std::span<const std::uint8_t> pixels, std::uint32_t width, std::uint32_t height,
                   std::uint32_t channels) {
  constexpr int kQuality = 85;  // of 100: 320 x 240 pixels of a gel with markers take some 20 kB
  if (pixels.empty()) return {};
  tjhandle handle = tjInitCompress();
  if (handle == nullptr) return {};
  unsigned char* bytes = nullptr;  // allocated by libturbojpeg
  unsigned long size = 0;
  const bool isGrey = channels == 1;
  const int failed = tjCompress2(handle, pixels.data(), static_cast<int>(width), 0, static_cast<int>(height),
                                 isGrey ? TJPF_GRAY : TJPF_RGB, &bytes, &size, isGrey ? TJSAMP_GRAY : TJSAMP_444,
                                 kQuality, TJFLAG_FASTDCT);
  std::string jpeg(reinterpret_cast<const char*>(bytes), failed != 0 ? 0 : size);
  tjFree(bytes);
  tjDestroy(handle);
  return jpeg;
}

}  // namespace traction::view
