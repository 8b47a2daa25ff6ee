// Strategy. First what the configuration lists as features, in its order, commands included: a loaded user set may
// undo all that went before. Then tractiond's own keys, each in the order that cameras want: format, offsets to 0,
// size, offsets, rate, exposure, gain, trigger, line, clock, link, chunks. Last what the session before this one found
// the camera at: a camera that lost its power has forgotten it.
#include "daemon/capture/aravis.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

namespace tractiond::capture {

std::string formatInWords(const std::string& name, std::int64_t code) {
  if (pixelFormatByCode(static_cast<std::uint32_t>(code)) != nullptr) return name;
  const std::string digits = fmt::format("0x{:08X}", static_cast<std::uint64_t>(code));
  return name.empty() ? digits : name + " (" + digits + ")";
}

std::vector<std::string> offeredFormats(ArvCamera* camera) {
  guint nameCount = 0, codeCount = 0;
  const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera, &nameCount, nullptr);
  std::vector<std::string> offered = taken(names, nameCount);
  gint64* codes = arv_camera_dup_available_pixel_formats(camera, &codeCount, nullptr);
  for (guint i = 0; codes != nullptr && codeCount == nameCount && i < codeCount; ++i)
    offered[i] = formatInWords(offered[i], codes[i]);
  g_free(codes);
  return offered;
}

void bestFirst(std::vector<const PixelFormatTraits*>& formats) {
  const auto rank = [](const PixelFormatTraits* format) {
    return std::tuple(format->colours == PixelColours::kMono, format->bits, format->bitsPerPixel);
  };
  std::stable_sort(formats.begin(), formats.end(), [&](const auto* a, const auto* b) { return rank(a) < rank(b); });
}

namespace {

using Result = tl::expected<void, Error>;

class Setter {
 public:
  Setter(ArvCamera* camera, CameraInfo& info, std::vector<Feature>& undo)
      : camera_(camera)
      , device_(arv_camera_get_device(camera))
      , info_(info)
      , undo_(undo) {}

  Result apply(const CameraOptions& options, const Standing* before) {
    Result result;
    for (std::size_t i = 0; result && i < options.features.size(); ++i) result = set(options.features[i]);
    if (result) result = options.pixelFormat.empty() ? chooseFormat() : setFormat(options.pixelFormat);
    if (result) result = setRegion(options);
    if (result && options.frameRate_Hz > 0) result = setRate(options.frameRate_Hz);
    if (result && options.exposure_us > 0) {
      switchOff("ExposureAuto");
      result = setQuantity("exposure_us", "us", exposureOf(device_), options.exposure_us);
    }
    if (result && options.gain) {
      switchOff("GainAuto");
      result = setQuantity("gain", "", gainOf(device_), *options.gain);
    }
    if (result) result = setTrigger(options);
    if (result && !options.strobeLine.empty()) result = setStrobe(options.strobeLine);
    if (result && options.ptp) result = setPtp();
    if (result) result = setLink(options);
    if (result) result = setChunks(options.chunks);
    if (result && before != nullptr) keep(*before, options);
    const std::vector<std::string> on = triggersOn();
    info_.triggered = !on.empty();
    if (info_.triggered) info_.trigger = "TriggerMode is On" + (on.front().empty() ? "" : " for " + joined(on));
    return result;
  }

 private:
  void remember(std::initializer_list<const char*> names) {
    for (const char* name : names)
      if (auto stood = standingAt(device_, name)) undo_.push_back(*std::move(stood));
  }

  tl::expected<std::string, Error> write(const Feature& feature) {
    remember({feature.name.c_str()});
    return writeFeature(device_, feature);
  }

  Result set(const Feature& feature) {
    auto line = write(feature);
    if (!line) return tl::unexpected(line.error());
    // Whether it rounds or ignores is not known: it may have rounded to the same value at an earlier start.
    if (line->find(" (asked: ") != std::string::npos) info_.warnings.push_back("the camera made " + *line);
    info_.settings.push_back(*std::move(line));
    return {};
  }

  /// By its code: cameras spell the names differently (RGB8Packed).
  Result setFormat(const std::string& name) {
    const std::string what = "the camera refuses camera.pixel_format = \"" + name + "\": ";
    const PixelFormatTraits* known = pixelFormatByName(name);
    if (known == nullptr) return failed(EX_CONFIG, what + "it is not one of " + std::string(kPixelFormatsInWords));
    Failure failure;
    if (arv_camera_get_pixel_format(camera_, failure.into()) != known->code()) {
      guint count = 0;
      gint64* codes = arv_camera_dup_available_pixel_formats(camera_, &count, failure.into());
      const bool offered = codes != nullptr && std::find(codes, codes + count, gint64{known->code()}) != codes + count;
      g_free(codes);
      if (failure.noAnswer()) return failed(EX_UNAVAILABLE, "the camera does not answer: " + failure.text());
      if (!offered) return failed(EX_CONFIG, what + "it offers " + joined(offeredFormats(camera_)));
      remember({"PixelFormat"});
      arv_camera_set_pixel_format(camera_, known->code(), failure.into());
      if (failure) return failed(failure.exitCode(), what + failure.text());
      if (arv_camera_get_pixel_format(camera_, failure.into()) != known->code())
        return failed(EX_CONFIG, what + "it did not take it");
    }
    info_.settings.push_back("PixelFormat = " + name);
    return {};
  }

  /// A camera that stands at a format which cannot be read is set to the best of those that can.
  Result chooseFormat() {
    Failure failure;
    const ArvPixelFormat stood = arv_camera_get_pixel_format(camera_, failure.into());
    if (failure || pixelFormatByCode(stood) != nullptr) return {};  // readPicture says what is wrong
    guint count = 0;
    gint64* codes = arv_camera_dup_available_pixel_formats(camera_, &count, nullptr);
    std::vector<const PixelFormatTraits*> formats;
    for (guint i = 0; codes != nullptr && i < count; ++i)
      if (const PixelFormatTraits* known = pixelFormatByCode(static_cast<std::uint32_t>(codes[i])))
        formats.push_back(known);
    g_free(codes);
    if (formats.empty()) return {};
    bestFirst(formats);
    const std::string own = text(arv_camera_get_pixel_format_as_string(camera_, failure.into()));
    if (auto set = setFormat(std::string(formats.front()->name)); !set) return set;
    info_.settings.back() += own.empty() ? " (chosen)" : " (chosen: " + own + " cannot be read)";
    return {};
  }

  /// What a size may be depends on the offsets that stand: they go to 0 first, and to where they shall be last.
  Result setRegion(const CameraOptions& options) {
    struct Axis {
      const char *size, *offset;
      int wanted, at;
    };
    const std::array<Axis, 2> axes{
        {{"Width", "OffsetX", options.width, options.offsetX}, {"Height", "OffsetY", options.height, options.offsetY}}};
    for (const Axis& axis : axes) {
      const bool movable = hasFeature(device_, axis.offset) &&
                           arv_device_get_feature_access_mode(device_, axis.offset) != ARV_GC_ACCESS_MODE_RO;
      if (axis.at > 0 && !movable)
        return failed(EX_CONFIG, std::string("the camera's picture cannot be moved: it has no ") + axis.offset);
      const gint64 stood = movable ? arv_device_get_integer_feature_value(device_, axis.offset, nullptr) : 0;
      if (axis.wanted > 0) {
        if (movable && stood != 0) remember({axis.offset});
        if (movable && stood != 0) arv_device_set_integer_feature_value(device_, axis.offset, 0, nullptr);
        if (auto done = set({axis.size, std::int64_t{axis.wanted}}); !done) return done;
      }
      if (axis.at >= 0 && movable) {
        if (auto done = set({axis.offset, std::int64_t{axis.at}}); !done) return done;
      } else if (axis.wanted > 0 && stood != 0) {
        gint64 low = 0, high = 0;
        arv_device_get_integer_feature_bounds(device_, axis.offset, &low, &high, nullptr);
        if (auto done = set({axis.offset, std::clamp<std::int64_t>(stood, low, high)}); !done) return done;
      }
    }
    return {};
  }

  Result report(const char* key, const char* unit, double asked, double got, const Failure& failure) {
    const std::string what = std::string("camera.") + key + " = " + number(asked);
    if (failure)
      return failed(failure.exitCode(),
                    (failure.noAnswer() ? "the camera does not answer to " : "the camera refuses ") + what + ": " +
                        failure.text());
    const double off = std::abs(got - asked);
    info_.settings.push_back(std::string(key) + " = " + number(got) +
                             (off > 1e-9 * std::abs(asked) ? " (asked: " + number(asked) + ")" : ""));
    if (off > 0.01 * std::abs(asked))
      info_.warnings.push_back("the camera made " + number(got) + " " + unit + " of " + what);
    return {};
  }

  /// Of those that cameras spell in several ways, and as whole numbers or not.
  Result setQuantity(const char* key, const char* unit, const Quantity& quantity, double value) {
    const std::string what = std::string("camera.") + key + " = " + number(value);
    if (quantity.feature.empty()) return failed(EX_CONFIG, what + ": the camera has no such setting");
    const double raw = value * quantity.perUnit;
    const bool whole = ARV_IS_GC_INTEGER(arv_device_get_feature(device_, quantity.feature.c_str()));
    const Feature feature =
        whole ? Feature{quantity.feature, std::int64_t{std::llround(raw)}} : Feature{quantity.feature, raw};
    if (auto written = write(feature); !written) {
      written.error().what = what + ": " + written.error().what;
      return tl::unexpected(written.error());
    }
    return report(key, unit, value, readQuantity(device_, quantity).value_or(value), Failure());
  }

  /// A value that the camera changes by itself is none that was set: one that stays automatic is a warning.
  void switchOff(const char* automatic) {
    if (!hasFeature(device_, automatic) || readFeature(device_, automatic) == "Off") return;
    if (auto done = set({automatic, std::string("Off")}); !done) info_.warnings.push_back(done.error().message());
  }

  /// Calls `use` with each trigger selected in turn, with its name, or once with an empty name if triggers have none.
  /// The one that was selected is put back.
  void forEachTrigger(auto use) {
    const std::string selected = readFeature(device_, "TriggerSelector");
    if (selected.empty()) return use(std::string());
    const auto select = [&](const std::string& trigger) {
      arv_device_set_string_feature_value(device_, "TriggerSelector", trigger.c_str(), nullptr);
    };
    for (const std::string& one : offeredEntries(device_, "TriggerSelector")) {
      select(one);
      use(one);
    }
    select(selected);
  }

  std::vector<std::string> triggersOn() {
    std::vector<std::string> on;
    forEachTrigger([&](const std::string& trigger) {
      if (readFeature(device_, "TriggerMode") == "On") on.push_back(trigger);
    });
    return on;
  }

  /// Aravis knows the names and switches of each make, but clears all triggers on the way: they are put back.
  Result setRate(double rate_Hz) {
    const std::vector<std::string> on = triggersOn();
    const std::string selected = readFeature(device_, "TriggerSelector");
    remember({"AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled", "AcquisitionFrameRate",
              "AcquisitionFrameRateAbs"});
    Failure failure;
    arv_camera_set_frame_rate(camera_, rate_Hz, failure.into());
    const double got = failure ? 0.0 : arv_camera_get_frame_rate(camera_, failure.into());
    if (auto done = report("frame_rate_hz", "frames/s", rate_Hz, got, failure); !done) return done;
    for (const std::string& trigger : on) {
      for (const Feature& feature : {Feature{"TriggerSelector", trigger}, Feature{"TriggerMode", std::string("On")}}) {
        if (feature.name == "TriggerSelector" && trigger.empty()) continue;
        if (auto line = writeFeature(device_, feature); !line) return tl::unexpected(line.error());
      }
    }
    if (!selected.empty()) arv_device_set_string_feature_value(device_, "TriggerSelector", selected.c_str(), nullptr);
    return {};
  }

  Result setTrigger(const CameraOptions& options) {
    if (options.trigger.empty()) return {};
    const std::string what = "camera.trigger = \"" + options.trigger + "\": ";
    remember({"TriggerSelector"});
    forEachTrigger([&](const std::string& /*trigger*/) {
      remember({"TriggerMode", "TriggerSource", "TriggerSelector"});
    });
    Failure failure;
    if (options.trigger == "off") {
      if (hasFeature(device_, "TriggerSelector") || hasFeature(device_, "TriggerMode"))
        arv_camera_clear_triggers(camera_, failure.into());
    } else {
      const std::string source = options.trigger == "software" ? "Software" : options.trigger;
      const std::vector<std::string> sources = offeredEntries(device_, "TriggerSource");
      if (!sources.empty() && std::find(sources.begin(), sources.end(), source) == sources.end())
        return failed(EX_CONFIG, what + "the camera has no such source; it has " + joined(sources));
      arv_camera_set_trigger(camera_, source.c_str(), failure.into());
    }
    if (failure)
      return failed(failure.exitCode(),
                    (failure.noAnswer() ? "the camera does not answer to " : "the camera refuses ") + what +
                        failure.text());
    if (const std::vector<std::string> on = triggersOn(); on.empty() != (options.trigger == "off"))
      return failed(EX_CONFIG, "the camera acknowledged " + what + "its TriggerMode is still " +
                                   (on.empty() ? "Off" : "On" + (on.front().empty() ? "" : " for " + joined(on))));
    info_.settings.push_back("trigger = " + options.trigger);
    if (options.trigger != "off" && options.frameRate_Hz > 0) {
      // Setting a trigger lifts the limit of the rate: it still bounds how fast triggers are followed.
      for (const char* name : {"AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"})
        if (hasFeature(device_, name)) std::ignore = writeFeature(device_, {name, true});
    }
    return {};
  }

  Result setStrobe(const std::string& line) {
    for (const Feature& feature : {Feature{"LineSelector", line}, Feature{"LineMode", std::string("Output")},
                                   Feature{"LineSource", std::string("ExposureActive")}}) {
      // Lines that can only be outputs have no mode, or one that cannot be written.
      if (feature.name == "LineMode" &&
          (!hasFeature(device_, "LineMode") || readFeature(device_, "LineMode") == "Output"))
        continue;
      if (auto done = set(feature); !done) {
        done.error().what = "camera.strobe_line = \"" + line + "\": " + done.error().what;
        return done;
      }
    }
    return {};
  }

  Result setPtp() {
    const std::string name = firstFeature(device_, {"PtpEnable", "GevIEEE1588", "PtpMode"});
    if (name.empty()) return failed(EX_CONFIG, "camera.ptp = true: the camera has no PTP", "set it to false");
    if (name != "PtpMode") return set({name, true});
    const std::vector<std::string> modes = offeredEntries(device_, "PtpMode");
    for (const char* mode : {"Slave", "SlaveOnly", "Auto", "On"})
      if (std::find(modes.begin(), modes.end(), mode) != modes.end()) return set({"PtpMode", std::string(mode)});
    return failed(EX_CONFIG,
                  "camera.ptp = true: the camera's PtpMode cannot follow a master; it offers " + joined(modes));
  }

  Result setLink(const CameraOptions& options) {
    Failure failure;
    if (options.packetDelay_ns > 0 && arv_camera_is_gv_device(camera_)) {
      remember({"GevSCPD"});
      arv_camera_gv_set_packet_delay(camera_, std::llround(options.packetDelay_ns), failure.into());
      const auto got = failure ? 0.0 : static_cast<double>(arv_camera_gv_get_packet_delay(camera_, failure.into()));
      if (auto done = report("packet_delay_ns", "ns", options.packetDelay_ns, got, failure); !done) return done;
    }
    if (options.throughput_bytes_per_s <= 0) return {};
    if (!hasFeature(device_, "DeviceLinkThroughputLimit"))
      return failed(EX_CONFIG, "camera.throughput_bytes_per_s: the camera has no DeviceLinkThroughputLimit",
                    "use camera.packet_delay_ns");
    if (hasFeature(device_, "DeviceLinkThroughputLimitMode"))
      if (auto done = set({"DeviceLinkThroughputLimitMode", std::string("On")}); !done) return done;
    return set({"DeviceLinkThroughputLimit", std::int64_t{options.throughput_bytes_per_s}});
  }

  Result setChunks(const std::vector<std::string>& chunks) {
    if (chunks.empty()) return {};
    const std::string what = "camera.chunks = " + joined(chunks) + ": ";
    if (!arv_camera_are_chunks_available(camera_, nullptr))
      return failed(EX_CONFIG, what + "the camera sends no chunk data");
    const std::vector<std::string> offered = offeredEntries(device_, "ChunkSelector");
    for (const std::string& chunk : chunks)
      if (std::find(offered.begin(), offered.end(), chunk) == offered.end())
        return failed(EX_CONFIG, what + "the camera offers " + joined(offered));
    Failure failure;
    remember({"ChunkModeActive"});
    std::string list;
    for (const std::string& chunk : chunks) list += (list.empty() ? "" : ",") + chunk;
    arv_camera_set_chunks(camera_, list.c_str(), failure.into());
    if (failure) return failed(failure.exitCode(), "the camera refuses " + what + failure.text());
    for (const std::string& chunk : chunks)
      if (!arv_camera_get_chunk_state(camera_, chunk.c_str(), failure.into()) && !failure)
        return failed(EX_CONFIG, "the camera acknowledged " + what + chunk + " is still not enabled");
    info_.settings.push_back("chunks = " + joined(chunks));
    return {};
  }

  void keepOne(const char* what, const char* unit, const Quantity& quantity, double before) {
    const auto same = [&](const std::optional<double>& value) {
      return value && std::abs(*value - before) <= 1e-3 * std::abs(before);
    };
    const std::optional<double> now = readQuantity(device_, quantity);
    if (!now || same(now)) return;
    const auto settings = info_.settings.size();
    const bool kept = setQuantity(what, unit, quantity, before) && same(readQuantity(device_, quantity));
    info_.settings.resize(settings);
    const std::string old = number(before) + (*unit == '\0' ? "" : std::string(" ") + unit);
    info_.warnings.push_back(
        std::string("the camera came back with ") + what + " = " + number(*now) +
        (kept ? "; set to " + old + " again, as before" : " instead of " + old + ", which it does not take"));
  }

  void keep(const Standing& before, const CameraOptions& options) {
    if (before.frameRate_Hz && options.frameRate_Hz <= 0 && arv_camera_is_frame_rate_available(camera_, nullptr)) {
      const double now = arv_camera_get_frame_rate(camera_, nullptr);
      if (std::abs(now - *before.frameRate_Hz) > 1e-3 * *before.frameRate_Hz) {
        const bool kept = setRate(*before.frameRate_Hz).has_value();
        info_.warnings.push_back("the camera came back with " + number(now) + " frames/s" +
                                 (kept ? "; set as before" : ", and does not take the rate from before"));
      }
    }
    if (before.exposure_us && options.exposure_us <= 0)
      keepOne("exposure_us", "us", exposureOf(device_), *before.exposure_us);
    if (before.gain && !options.gain) keepOne("gain", "", gainOf(device_), *before.gain);
  }

  ArvCamera* camera_;
  ArvDevice* device_;
  CameraInfo& info_;
  std::vector<Feature>& undo_;
};

}  // namespace

tl::expected<void, Error> applySettings(ArvCamera* camera, const CameraOptions& options, const Standing* before,
                                        CameraInfo& info, std::vector<Feature>& undo) {
  return Setter(camera, info, undo).apply(options, before);
}

}  // namespace tractiond::capture
