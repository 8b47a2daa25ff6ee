#include "daemon/capture/sent_picture.h"

#include <array>
#include <limits>

namespace tractiond::capture {
namespace {

struct PayloadType {
  int code;
  const char* name;
  const char* remedy;
};

/// GigE Vision 2.2, table of payload types; features by the SFNC.
constexpr std::array<PayloadType, 8> kOthers = {{
    {2, "raw data", "choose a mode of the camera that sends pictures"},
    {3, "files", "choose a mode of the camera that sends pictures"},
    {6, "JPEG", "in camera.features: { ImageCompressionMode = \"Off\" }"},
    {7, "JPEG 2000", "in camera.features: { ImageCompressionMode = \"Off\" }"},
    {8, "H.264", "in camera.features: { ImageCompressionMode = \"Off\" }"},
    {9, "multi-zone pictures", "in camera.features: { DeviceTapGeometry = \"Geometry_1X_1Y\" }"},
    {10, "multi-part pictures",
     "enable a single component in camera.features: { ComponentSelector = \"Range\" }, { ComponentEnable = false } for "
     "each but Intensity"},
    {11, "GenDC containers", "in camera.features: { GenDCStreamingMode = \"Off\" }"},
}};
constexpr int kMakersOwn = 0x8000;
constexpr PayloadType kOwn = {kMakersOwn, "a format of its maker's own, such as multi-zone pictures",
                              "choose a mode of the camera that sends pictures of the standard, payload type 1"};
constexpr PayloadType kUnknown = {0, "no pictures", "choose a mode of the camera that sends pictures"};

/// nullptr: a type that has a picture.
const PayloadType* otherType(int code) {
  if (code == SentPicture::kPicture || code == SentPicture::kChunks || code == SentPicture::kPictureAndChunks)
    return nullptr;
  for (const PayloadType& one : kOthers)
    if (one.code == code) return &one;
  return code >= kMakersOwn ? &kOwn : &kUnknown;
}

std::string hex(std::uint32_t value, int digits) {
  std::string text = "0x";
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) text += "0123456789ABCDEF"[(value >> shift) & 15U];
  return text;
}

std::string nameOf(std::uint32_t format) {
  const PixelFormatTraits* known = pixelFormatByCode(format);
  return known == nullptr ? hex(format, 8) : std::string(known->name);
}

std::string sides(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// Bytes of a row with what is behind it; nothing: rows begin within bytes, and cannot have anything behind them.
std::optional<std::size_t> strideOf(const SentPicture& sent, const PixelFormatTraits& format, int width) {
  const int row = format.stride(width);
  if (row == 0) return sent.paddingX == 0 ? std::optional<std::size_t>(0) : std::nullopt;
  const auto stride = static_cast<std::size_t>(row) + static_cast<std::size_t>(sent.paddingX);
  if (stride > static_cast<std::size_t>(std::numeric_limits<int>::max())) return std::nullopt;
  return stride;
}

bool sameShape(const SentPicture& sent, const PictureShape& agreed) {
  return sent.width == agreed.width && sent.height == agreed.height && sent.format == agreed.format;
}

}  // namespace

std::optional<PictureLayout> layoutOf(const SentPicture& sent, const PictureShape& agreed) {
  const PixelFormatTraits* format = pixelFormatByCode(agreed.format);
  if (otherType(sent.payloadType) != nullptr || format == nullptr || sent.paddingX < 0 || sent.paddingY < 0)
    return std::nullopt;
  if (sent.payloadType == SentPicture::kChunks) {
    if (sent.size != agreed.size) return std::nullopt;
    return PictureLayout{format->stride(agreed.width), agreed.size};
  }
  if (!sameShape(sent, agreed)) return std::nullopt;
  const auto stride = strideOf(sent, *format, agreed.width);
  if (!stride) return std::nullopt;
  const std::size_t rows = *stride == 0 ? agreed.size : *stride * static_cast<std::size_t>(agreed.height);
  const std::size_t bytes = rows + static_cast<std::size_t>(sent.paddingY);
  if (sent.size < bytes) return std::nullopt;
  return PictureLayout{static_cast<int>(*stride), bytes};
}

std::string deviation(const SentPicture& sent, const PictureShape& agreed) {
  if (const PayloadType* other = otherType(sent.payloadType)) {
    const auto code = static_cast<std::uint32_t>(sent.payloadType);
    return "sends " + std::string(other->name) + " (payload type " +
           (code >= kMakersOwn ? hex(code, 4) : std::to_string(code)) + "), which cannot be read";
  }
  if (layoutOf(sent, agreed)) return {};
  const std::string picture = "a picture of " + sides(agreed.width, agreed.height) + " pixels in " +
                              nameOf(agreed.format) + " has " + std::to_string(agreed.size);
  if (sent.payloadType == SentPicture::kChunks && sent.size == 0)
    return "sends chunk data (payload type 4) that cannot be read";
  if (sent.payloadType == SentPicture::kChunks)
    return "sends " + std::to_string(sent.size) + " bytes as the first chunk of its chunk data, " + picture;
  if (sent.width != agreed.width || sent.height != agreed.height)
    return "sends pictures of " + sides(sent.width, sent.height) + " pixels, its Width and Height say " +
           sides(agreed.width, agreed.height);
  if (sent.format != agreed.format)
    return "sends pictures in " + nameOf(sent.format) + ", its PixelFormat says " + nameOf(agreed.format);
  const std::string padding = std::to_string(sent.paddingX) + " bytes behind each row and " +
                              std::to_string(sent.paddingY) + " behind the last";
  const PixelFormatTraits* format = pixelFormatByCode(agreed.format);
  if (format != nullptr && !strideOf(sent, *format, agreed.width))
    return "says that " + padding + " are padding, though its rows end within a byte";
  return "sends " + std::to_string(sent.size) + " bytes; " + picture +
         (sent.paddingX == 0 && sent.paddingY == 0 ? "" : ", and " + padding + " are padding by its leader");
}

std::string remedyOf(int payloadType) {
  const PayloadType* other = otherType(payloadType);
  if (other != nullptr) return other->remedy;
  return "set camera.width_px, camera.height_px or camera.pixel_format to what it sends, or update its firmware";
}

}  // namespace tractiond::capture
