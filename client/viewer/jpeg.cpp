#include "client/viewer/jpeg.h"

#include <turbojpeg.h>

namespace traction::view {

namespace {

constexpr int kQuality = 85;  // of 100: 320 x 240 pixels of a gel with markers take some 20 kB

}  // namespace

struct JpegEncoder::Compressor {
  tjhandle handle = tjInitCompress();
  unsigned char* bytes = nullptr;  // allocated by libturbojpeg, which enlarges it if necessary
  unsigned long size = 0;
};

JpegEncoder::JpegEncoder()
    : compressor_(std::make_unique<Compressor>()) {}

JpegEncoder::~JpegEncoder() {
  tjFree(compressor_->bytes);
  if (compressor_->handle != nullptr) tjDestroy(compressor_->handle);
}

std::string_view JpegEncoder::encode(const Preview& preview) {
  auto& [handle, bytes, size] = *compressor_;
  if (handle == nullptr || preview.pixels.empty()) return {};
  const bool isGrey = preview.channels == 1;
  const int failed = tjCompress2(handle, preview.pixels.data(), static_cast<int>(preview.width), 0,
                                 static_cast<int>(preview.height), isGrey ? TJPF_GRAY : TJPF_RGB, &bytes, &size,
                                 isGrey ? TJSAMP_GRAY : TJSAMP_444, kQuality, TJFLAG_FASTDCT);
  if (failed != 0) return {};
  return {reinterpret_cast<const char*>(bytes), size};
}

}  // namespace traction::view
