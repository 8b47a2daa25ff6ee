#include "daemon/capture/sent_picture.h"

#include <spdlog/fmt/fmt.h>

#include <array>

namespace tractiond::capture {
namespace {

struct PayloadType {
  int code;
  const char* name;
  const char* remedy;
};

/// GigE Vision 2.2, table of payload types; features by the SFNC.
constexpr std::array<PayloadType, 4> kOthers = {{
    {6, "JPEG", "in camera.features: { ImageCompressionMode = \"Off\" }"},
    {7, "JPEG 2000", "in camera.features: { ImageCompressionMode = \"Off\" }"},
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

std::string nameOf(std::uint32_t format) {
  const PixelFormatTraits* known = pixelFormatByCode(format);
  return known == nullptr ? fmt::format("0x{:08X}", format) : std::string(known->name);
}

std::string sides(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
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
  if (sent.width != agreed.width || sent.height != agreed.height || sent.format != agreed.format) return std::nullopt;
  const int row = format->stride(agreed.width);
  if (row == 0 && sent.paddingX != 0) return std::nullopt;  // rows begin within bytes
  const std::size_t stride = row == 0 ? 0 : static_cast<std::size_t>(row) + static_cast<std::size_t>(sent.paddingX);
  const std::size_t rows = row == 0 ? agreed.size : stride * static_cast<std::size_t>(agreed.height);
  const std::size_t bytes = rows + static_cast<std::size_t>(sent.paddingY);
  if (sent.size < bytes) return std::nullopt;
  return PictureLayout{static_cast<int>(stride), bytes};
}

std::string deviation(const SentPicture& sent, const PictureShape& agreed) {
  if (const PayloadType* other = otherType(sent.payloadType)) {
    const int code = sent.payloadType;
    return fmt::format("sends {} (payload type {}), which cannot be read", other->name,
                       code >= kMakersOwn ? fmt::format("0x{:04X}", code) : fmt::format("{}", code));
  }
  if (layoutOf(sent, agreed)) return {};
  const std::string picture = "a picture of " + sides(agreed.width, agreed.height) + " pixels in " +
                              nameOf(agreed.format) + " has " + std::to_string(agreed.size);
  if (sent.payloadType == SentPicture::kChunks)
    return "sends " + std::to_string(sent.size) + " bytes as the first chunk of its chunk data, " + picture;
  if (sent.width != agreed.width || sent.height != agreed.height)
    return "sends pictures of " + sides(sent.width, sent.height) + " pixels, its Width and Height say " +
           sides(agreed.width, agreed.height);
  if (sent.format != agreed.format)
    return "sends pictures in " + nameOf(sent.format) + ", its PixelFormat says " + nameOf(agreed.format);
  const std::string padding = std::to_string(sent.paddingX) + " bytes behind each row and " +
                              std::to_string(sent.paddingY) + " behind the last";
  return "sends " + std::to_string(sent.size) + " bytes; " + picture +
         (sent.paddingX == 0 && sent.paddingY == 0 ? "" : ", and " + padding + " are padding by its leader");
}

std::string remedyOf(int payloadType) {
  const PayloadType* other = otherType(payloadType);
  if (other != nullptr) return other->remedy;
  return "set camera.width_px, camera.height_px or camera.pixel_format to what it sends, or update its firmware";
}

}  // namespace tractiond::capture
