#include "client/viewer/jpeg.h"

#include <turbojpeg.h>

namespace traction::view {

std::string jpegOf(const Preview& preview) {
  constexpr int kQuality = 85;  // of 100: 320 x 240 pixels of a gel with markers take some 20 kB
  if (preview.pixels.empty()) return {};
  tjhandle handle = tjInitCompress();
  if (handle == nullptr) return {};
  unsigned char* bytes = nullptr;  // allocated by libturbojpeg
  unsigned long size = 0;
  const bool isGrey = preview.channels == 1;
  const int failed = tjCompress2(handle, preview.pixels.data(), static_cast<int>(preview.width), 0,
                                 static_cast<int>(preview.height), isGrey ? TJPF_GRAY : TJPF_RGB, &bytes, &size,
                                 isGrey ? TJSAMP_GRAY : TJSAMP_444, kQuality, TJFLAG_FASTDCT);
  std::string jpeg(reinterpret_cast<const char*>(bytes), failed != 0 ? 0 : size);
  tjFree(bytes);
  tjDestroy(handle);
  return jpeg;
}

}  // namespace traction::view
