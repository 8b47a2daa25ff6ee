#include "daemon/config.h"

#include "daemon/records/pixel_format.h"
#include "proto/traction/v1/endpoints.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <utility>

namespace tractiond {
namespace {

template <typename Enum>
Choice choice(Enum& value, std::vector<std::pair<std::string, Enum>> meanings) {
  Choice result;
  for (const auto& [word, meaning] : meanings) result.words.push_back(word);
  result.get = [&value, meanings] {
    for (const auto& [word, meaning] : meanings) {
      if (meaning == value) return word;
    }
    return std::string();
  };
  result.set = [&value, meanings](const std::string& chosen) {
    for (const auto& [word, meaning] : meanings) {
      if (word == chosen) value = meaning;
    }
  };
  return result;
}

Choice choice(std::string& value, std::vector<std::string> words) {
  return {std::move(words), [&value] { return value; }, [&value](const std::string& word) { value = word; }};
}

bool isOnThisHost(std::string_view endpoint) {
  return endpoint.starts_with("ipc://") ||
         std::ranges::any_of(std::array{"tcp://127.", "tcp://localhost:", "tcp://lo:", "tcp://[::1]:"},
                             [&](const char* start) { return endpoint.starts_with(start); });
}

std::string endpointFault(const std::vector<std::string>& endpoints, bool insecure) {
  for (const std::string& endpoint : endpoints) {
    if (!endpoint.starts_with("tcp://") && !endpoint.starts_with("ipc://")) {
      return "holds \"" + endpoint + "\", which is neither tcp://ADDRESS:PORT nor ipc://PATH";
    }
    if (!insecure && !isOnThisHost(endpoint)) {
      return "holds \"" + endpoint +
             "\", which other hosts reach, and nobody there is asked who he is; "
             "publish.insecure = true allows that";
    }
  }
  return "";
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char letter : text) {
    if (letter == '"' || letter == '\\') {
      result += '\\';
      result += letter;
    } else if (static_cast<unsigned char>(letter) < 0x20 || letter == 0x7f) {
      std::array<char, 8> code{};
      std::snprintf(code.data(), code.size(), "\\u%04X", static_cast<unsigned>(letter));
      result += code.data();
    } else {
      result += letter;
    }
  }
  return result + '"';
}

std::string pixelFormatFault(const std::string& name) {
  if (name.empty() || pixelFormatByName(name) != nullptr) return "";
  return quoted(name) + " is none that can be read: " + std::string(kPixelFormatsInWords);
}

/// The shortest decimal that reads back as the same number; whole ones without an exponent.
std::string number(double value) {
  if (value == std::trunc(value) && std::abs(value) < 1e15) return std::to_string(static_cast<std::int64_t>(value));
  std::array<char, 40> text{};
  for (int digits = 1; digits <= 17; ++digits) {
    std::snprintf(text.data(), text.size(), "%.*g", digits, value);
    if (std::stod(text.data()) == value) break;
  }
  return text.data();
}

/// A value as it is written in TOML; empty: not set.
struct Written {
  const sensor::Range& range;

  std::string operator()(const bool* value) const { return *value ? "true" : "false"; }
  std::string operator()(const int* value) const { return number(*value * range.perUnit); }
  std::string operator()(const double* value) const { return number(*value * range.perUnit); }
  std::string operator()(const std::optional<double>* value) const {
    return *value ? number(**value * range.perUnit) : "";
  }
  std::string operator()(const std::string* value) const { return quoted(*value); }
  std::string operator()(const std::vector<std::string>* value) const {
    std::string list;
    for (const std::string& one : *value) list += (list.empty() ? "" : ", ") + quoted(one);
    return "[" + list + "]";
  }
  std::string operator()(const Choice& value) const { return quoted(value.get()); }
  std::string operator()(const std::vector<capture::Feature>* value) const;
};

struct ScalarText {
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(std::int64_t value) const { return std::to_string(value); }
  std::string operator()(const std::string& value) const { return quoted(value); }
  std::string operator()(double value) const {
    std::string text = number(value);  // with a point or an exponent: else it would read back as a whole number
    return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
  }
};

bool isBareKey(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char letter) {
    return std::isalnum(letter) || letter == '_' || letter == '-';
  });
}

std::string written(const Key& key) {
  return std::visit(Written{key.range}, key.value);
}

/// "default 5; 0 to 10 ms"
std::string limits(const Key& key, const std::string& standard) {
  std::string text = "default " + (standard.empty() ? "none" : standard);
  if (const auto* choice = std::get_if<Choice>(&key.value)) {
    text += ";";
    for (std::size_t i = 0; i < choice->words.size(); ++i) text += (i ? ", " : " ") + quoted(choice->words[i]);
  } else if (key.range.least < key.range.most) {
    text += "; " + number(key.range.least) + " to " + number(key.range.most);
    if (!key.unit.empty()) text += " " + std::string(key.unit);
  }
  return text;
}

std::string featuresText(const std::vector<capture::Feature>& features) {
  std::string text;
  for (const capture::Feature& feature : features) {
    text += (text.empty() ? "\n" : ",\n") + ("  { " + (isBareKey(feature.name) ? feature.name : quoted(feature.name)));
    text += " = " + std::visit(ScalarText{}, feature.value) + " }";
  }
  return text.empty() ? "[]" : "[" + text + "\n]";
}

std::string Written::operator()(const std::vector<capture::Feature>* value) const {
  return featuresText(*value);
}

constexpr const char* kFeaturesHelp =
    "# Each as one { Name = value }, set in the order of the list and read back; a command is { Name = true } and is\n"
    "# waited for. The same name may come again, as for selectors:\n"
    "# features = [ { UserSetSelector = \"Default\" }, { UserSetLoad = true },\n"
    "#              { BalanceRatioSelector = \"Red\" }, { BalanceRatio = 1.4 },\n"
    "#              { BalanceRatioSelector = \"Blue\" }, { BalanceRatio = 1.8 } ]\n";

}  // namespace

std::vector<Key> keysOf(Config& config) {
  const auto name = [&value = config.sensor.name]() -> std::string {
    return value.empty() || traction::isValidName(value) ? "" : "must be 1 to 24 of A-Z, a-z, 0-9, _ and -";
  };
  const auto endpoints = [&config](const std::vector<std::string>& list) {
    return [&list, &config] { return endpointFault(list, config.insecure); };
  };
  capture::CameraOptions& camera = config.camera;
  solve::SolveOptions& solve = config.solve;
  publish::PublishOptions& publish = config.publish;
  using capture::PacketSocket;
  using sensor::elastic::Model;

  // clang-format off
  return {
      {"sensor", "name", "", "Of the sensor, in topics and messages; empty: the name of the instance.",
          &config.sensor.name, {}, name},
      {"sensor", "gel_file", "", "What the sensor is made of, see gels/paper.toml beside this file; empty: as there.",
          &config.sensor.gelFile},

      {"camera", "id", "", "Device id, Vendor-Serial, IP or MAC address; empty: the first camera found.",
          &camera.id},
      {"camera", "wait", "", "A camera that is not there yet is waited for; false: that is an error.",
          &camera.wait},
      {"camera", "features", "", "First of all: any features by their GenICam names, see below.",
          &camera.features},
      {"camera", "pixel_format", "", "By the name of the Pixel Format Naming Convention, such as Mono12p, BayerRG8 or "
          "RGB8; empty: as the camera stands.",
          &camera.pixelFormat, {}, [&camera] { return pixelFormatFault(camera.pixelFormat); }},
      {"camera", "width_px", "px", "Of the picture; 0: as the camera stands.",
          &camera.width, {0, 65535}},
      {"camera", "height_px", "px", "Of the picture; 0: as the camera stands.",
          &camera.height, {0, 65535}},
      {"camera", "offset_x_px", "px", "Of the picture on the sensor; -1: as the camera stands.",
          &camera.offsetX, {-1, 65535}},
      {"camera", "offset_y_px", "px", "Of the picture on the sensor; -1: as the camera stands.",
          &camera.offsetY, {-1, 65535}},
      {"camera", "frame_rate_hz", "frames/s", "0: as the camera stands.",
          &camera.frameRate_Hz, {0, 10'000}},
      {"camera", "exposure_us", "us", "0: as the camera stands.",
          &camera.exposure_us, {0, 10e6}},
      {"camera", "gain", "", "In the camera's own unit; absent: as the camera stands.",
          &camera.gain, {-1000, 1e5}},
      {"camera", "trigger", "", "Of each frame: off, software (tractionctl trigger), or a source of the camera: Line1; empty: as it stands.",
          &camera.trigger},
      {"camera", "strobe_line", "", "Of the camera, an output that is active while it exposes: Line2; empty: none is set.",
          &camera.strobeLine},
      {"camera", "ptp", "", "The camera's clock follows the network's (IEEE 1588).",
          &camera.ptp},
      {"camera", "chunks", "", "Sent with each frame, where the camera can: ExposureTime, Gain, Timestamp, FrameID, LineStatusAll.",
          &camera.chunks},
      {"camera", "packet_delay_ns", "ns", "Between two packets, for several cameras on one link; 0: as the camera stands.",
          &camera.packetDelay_ns, {0, 1e7}},
      {"camera", "throughput_bytes_per_s", "bytes/s", "That the camera sends at most; 0: as it stands.",
          &camera.throughput_bytes_per_s, {0, 2e9}},
      {"camera", "packet_size_bytes", "bytes", "With headers; 0: the MTU of the interface, at most 9000.",
          &camera.packetSize_bytes, {0, 65'500}},
      {"camera", "receive_buffer_bytes", "bytes", "Of the kernel; 8 MiB hold 150 ms of 640 x 480 RGB8 at 60 frames/s.",
          &camera.receiveBuffer_bytes, {65'536, 1 << 30}},
      {"camera", "packet_timeout_us", "us", "A packet that is missing for longer is asked for again.",
          &camera.packetTimeout_us, {100, 1e6}},
      {"camera", "frame_retention_us", "us", "A frame whose packets stay away for longer is given up.",
          &camera.frameRetention_us, {1000, 10e6}},
      {"camera", "packet_socket", "", "Receive past the IP stack, unfiltered: needs CAP_NET_RAW; late on the loopback.",
          choice(camera.packetSocket,
                 {{"off", PacketSocket::kOff}, {"auto", PacketSocket::kAuto}, {"on", PacketSocket::kOn}})},
      {"camera", "buffers", "frames", "For the driver to fill; up to 7 are on their way to the tracker.",
          &camera.buffers, {9, 1000}},
      {"camera", "silence_timeout_ms", "ms", "Without a frame for longer the camera is lost; 0: only if it says so.",
          &camera.silenceTimeout_ms, {0, 3'600'000}},
      {"camera", "fake_interface", "", "The test camera inside the driver may be opened.",
          &camera.fakeInterface},

      {"track", "zero_frames", "frames", "Averaged for a rest pose.",
          &config.track.zeroFrames, {2, 10'000}},
      {"track", "min_valid_fraction", "", "Of the markers; with fewer no zero is taken, and the fields are flagged.",
          &config.track.minValidFraction, {0.1, 1}},

      {"solve", "model", "", "Of the gel: the finite block, or the half-space of the paper.",
          choice(solve.model, {{"block", Model::kBlock}, {"half-space", Model::kHalfSpace}})},
      {"solve", "regularisation", "", "Tikhonov's, relative to the largest singular value of the influence matrix.",
          &solve.regularisation, {1e-6, 1}},
      {"solve", "contact_aware", "", "Solve for the nodes alone that carry something, where the contact is small enough.",
          &solve.contactAware},
      {"solve", "noise_px", "px", "Of a marker's centre in one frame; what the search for contacts reckons with.",
          &solve.noise_px, {1e-4, 10}},
      {"solve", "force_scale_newton", "N", "Usual force of a node in the contact step, at least; stronger contacts raise it.",
          &solve.forceScale_N, {1e-6, 1000}},
      {"solve", "max_missing_fraction", "", "Of the markers; with more missing the field is not valid.",
          &solve.maxMissingFraction, {0, 0.9}},
      {"solve", "min_press_newton", "N", "Normal force above which there is a centre of pressure.",
          &solve.minPressForCentre_N, {0, 1000}},

      {"publish", "insecure", "", "Endpoints may be where other hosts reach them: whoever does reads, zeroes and calibrates.",
          &config.insecure},
      {"publish", "stream", "", "Endpoints of all messages; empty: the instance's own.",
          &publish.stream, {}, endpoints(publish.stream)},
      {"publish", "latest", "", "Endpoints of the newest field alone; empty: the instance's own.",
          &publish.latest, {}, endpoints(publish.latest)},
      {"publish", "control", "", "Endpoints for status, description and zero; empty: the instance's own.",
          &config.controlEndpoints, {}, endpoints(config.controlEndpoints)},
      {"publish", "high_water_mark", "messages", "That wait for one slow subscriber before it loses some.",
          &publish.highWaterMark, {1, 100'000}},

      {"log", "level", "", "Of what goes to standard error.",
          choice(config.logLevel, {"debug", "info", "warning", "error"})},
  };
  // clang-format on
}

std::string configText(const Config& config) {
  Config copy = config, standard;
  const std::vector<Key> keys = keysOf(copy);
  const std::vector<Key> standards = keysOf(standard);
  std::string text = "# Every key of tractiond: its meaning, default, range and unit. Any may be left out.\n"
                     "# The instance NAME reads /etc/tractiond/NAME.toml. Its own endpoints are ipc sockets in its "
                     "runtime directory,\n"
                     "# and for the instance \"default\" also tcp on the loopback, ports 9872 to 9874.\n";
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const Key& key = keys[i];
    const bool first = i == 0 || keys[i - 1].section != key.section;
    if (first) text += "\n[" + std::string(key.section) + "]\n";
    const std::string value = written(key);
    text += (first ? "# " : "\n# ") + std::string(key.help) + "\n";
    if (key.name == "features") text += kFeaturesHelp;
    text += (value.empty() ? "#" : "") + std::string(key.name) + " = " + (value.empty() ? "0" : value);
    text += "  # " + limits(key, written(standards[i])) + "\n";
  }
  return text;
}

}  // namespace tractiond
