// What an open camera says of its picture and its link.
#include "daemon/capture/aravis.h"

#include <cstdlib>
#include <tuple>
#include <utility>

namespace tractiond::capture {
namespace {

/// Returns whether the camera itself changes the value that the feature switches: the value read now will not stay.
bool isAutomatic(ArvDevice* device, const char* automatic) {
  const std::string choice = readFeature(device, automatic);
  return !choice.empty() && choice != "Off";
}

constexpr gint64 kMostSide_px = 65535;

bool isSide(gint64 side) {
  return side > 0 && side <= kMostSide_px;
}

/// Reads Width or Height, and says what is wrong with one that cannot be.
tl::expected<int, Error> readSide(ArvDevice* device, const char* name) {
  Failure failure;
  const gint64 side = arv_device_get_integer_feature_value(device, name, failure.into());
  if (failure)
    return failed(EX_UNAVAILABLE, "the camera does not tell the size of its picture: " + std::string(name),
                  failure.text());
  if (isSide(side)) return static_cast<int>(side);
  gint64 low = 0, high = 0;
  arv_device_get_integer_feature_bounds(device, name, &low, &high, failure.into());
  if (failure || !isSide(low) || !isSide(high)) std::tie(low, high) = std::pair<gint64, gint64>(1, kMostSide_px);
  const std::uint32_t turned = __builtin_bswap32(static_cast<std::uint32_t>(side));
  return failed(EX_UNAVAILABLE,
                "the camera says " + std::string(name) + " = " + std::to_string(side) + " pixels, possible are " +
                    std::to_string(low) + " to " + std::to_string(high),
                isSide(turned) ? "with its bytes in the other order it is " + std::to_string(turned) +
                                     ": its description states a wrong byte order; update its firmware"
                               : "set it with the maker's tool, or update its firmware");
}

}  // namespace

tl::expected<void, Error> readPicture(ArvCamera* camera, CameraInfo& info) {
  Failure failure;
  const ArvPixelFormat code = arv_camera_get_pixel_format(camera, failure.into());
  if (failure) return failed(EX_UNAVAILABLE, "the camera does not tell its pixel format: " + failure.text());
  const PixelFormatTraits* known = pixelFormatByCode(code);
  if (known == nullptr) {
    const std::string own = formatInWords(text(arv_camera_get_pixel_format_as_string(camera, failure.into())), code);
    const std::vector<std::string> offered = offeredFormats(camera);
    return failed(EX_CONFIG,
                  "the camera sends " + own + ", which cannot be read" +
                      (offered.empty() ? "" : "; of what it offers none can: " + joined(offered)),
                  pixelFormatByCode(__builtin_bswap32(code)) != nullptr
                      ? "with its bytes in the other order it is " +
                            std::string(pixelFormatByCode(__builtin_bswap32(code))->name) +
                            ": its description states a wrong byte order; update its firmware"
                      : "formats that can be read: " + std::string(kPixelFormatsInWords));
  }
  info.format = known->format;
  ArvDevice* device = arv_camera_get_device(camera);
  const auto width = readSide(device, "Width"), height = readSide(device, "Height");
  if (!width || !height) return tl::unexpected((width ? height : width).error());
  info.shape = {*width, *height, known->size(*width, *height), code};
  info.cut.clear();
  for (const char* name : {"OffsetX", "OffsetY", "BinningHorizontal", "BinningVertical", "DecimationHorizontal",
                           "DecimationVertical", "ReverseX", "ReverseY"}) {
    const std::string value = readFeature(device, name);
    const bool isFactor = *name == 'B' || *name == 'D';
    if (!value.empty() && value != "false" && value != "0" && !(isFactor && value == "1"))
      info.cut += std::string(", ") + name + " = " + value;
  }
  if (arv_camera_is_frame_rate_available(camera, nullptr) && !isAutomatic(device, "AcquisitionFrameRateAuto")) {
    const double rate_Hz = arv_camera_get_frame_rate(camera, failure.into());
    if (!failure && rate_Hz > 0) info.standing.frameRate_Hz = rate_Hz;
  }
  if (!isAutomatic(device, "ExposureAuto")) info.standing.exposure_us = readQuantity(device, exposureOf(device));
  if (!isAutomatic(device, "GainAuto")) info.standing.gain = readQuantity(device, gainOf(device));
  info.frameRate_Hz = info.triggered ? 0.0 : info.standing.frameRate_Hz.value_or(0.0);
  info.exposure_s = info.standing.exposure_us.value_or(0.0) * 1e-6;
  return {};
}

CameraLink readLink(ArvCamera* camera, ArvStream* stream, const ControlGuard& guard, const CameraLink& before,
                    std::initializer_list<const std::atomic<bool>*> lost) {
  const auto isLost = [&] { return std::ranges::any_of(lost, [](const auto* each) { return each->load(); }); };
  ArvDevice* device = arv_camera_get_device(camera);
  CameraLink link;
  if (ARV_IS_GV_STREAM(stream)) {
    std::uint64_t resent = 0, missing = 0;
    arv_gv_stream_get_statistics(ARV_GV_STREAM(stream), &resent, &missing);
    link.set_packets_resent(before.packets_resent() + resent);
    link.set_packets_missing(before.packets_missing() + missing);
    link.set_packets_refused(before.packets_refused() + packetsRefused(stream) + guard.refused());
  }
  const auto firstOf = [&](std::initializer_list<const char*> names) -> std::string {
    for (const char* name : names) {
      if (isLost()) return {};  // each further question would take seconds
      if (std::string value = readFeature(device, name); !value.empty()) return value;
    }
    return {};
  };
  const auto number = [](const std::string& text) { return std::strtod(text.c_str(), nullptr); };
  link.set_ptp(firstOf({"PtpStatus", "GevIEEE1588Status"}));
  if (!link.ptp().empty() && !isLost()) {
    for (const char* latch : {"PtpDataSetLatch", "GevIEEE1588DataSetLatch"})
      if (hasFeature(device, latch)) arv_device_execute_command(device, latch, nullptr);
    const std::string offset_ns = firstOf({"PtpOffsetFromMaster", "GevIEEE1588OffsetFromMaster"});
    if (!offset_ns.empty()) link.set_ptp_offset_s(number(offset_ns) * 1e-9);
  }
  const std::string temperature = firstOf({"DeviceTemperature", "TemperatureAbs"});
  if (!temperature.empty()) link.set_temperature(number(temperature));
  return link;
}

}  // namespace tractiond::capture
