// What an open camera says of its picture and its link.
#include "daemon/capture/aravis.h"

#include <cstdlib>

namespace tractiond::capture {
namespace {

/// Returns whether the camera itself changes the value that the feature switches: the value read now will not stay.
bool isAutomatic(ArvDevice* device, const char* automatic) {
  const std::string choice = readFeature(device, automatic);
  return !choice.empty() && choice != "Off";
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
                  "formats that can be read: " + std::string(kPixelFormatsInWords));
  }
  info.format = known->format;
  gint x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera, &x, &y, &width, &height, failure.into());
  if (failure || width <= 0 || height <= 0)
    return failed(EX_UNAVAILABLE, "the camera does not tell the size of its picture", failure.text());
  if (width > 65535 || height > 65535)
    return failed(EX_UNAVAILABLE, "the camera claims a picture of " + std::to_string(width) + " x " +
                                      std::to_string(height) + " pixels");
  info.shape = {width, height, known->size(width, height), code};
  ArvDevice* device = arv_camera_get_device(camera);
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
