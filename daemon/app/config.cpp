#include "daemon/app/config.h"

#include "base/pixel_format.h"
#include "proto/traction/v1/endpoints.h"

#include <filesystem>
#include <iterator>

namespace tractiond {
namespace {

std::string endpointFault(const std::vector<std::string>& endpoints, bool insecure) {
  for (const std::string& endpoint : endpoints) {
    if (!endpoint.starts_with("tcp://") && !endpoint.starts_with("ipc://")) {
      return "holds \"" + endpoint + "\", which is neither tcp://ADDRESS:PORT nor ipc://PATH";
    }
    if (!insecure && !isOnThisHost(endpoint)) {
      return "holds \"" + endpoint +
             "\", which other hosts reach without authentication; "
             "publish.insecure = true allows that";
    }
  }
  return "";
}

std::string pixelFormatFault(const std::string& name) {
  if (name.empty() || pixelFormatByName(name) != nullptr) return "";
  return quoted(name) + " is not supported; supported formats: " + std::string(kPixelFormatsInWords);
}

/// Returns whether a key may change while the daemon runs. Keys that change the picture, or the place of the gel in it,
/// may not, as the zero would no longer hold.
bool isLive(const Key& key) {
  constexpr std::array<std::string_view, 14> kOfTheCamera = {"features",
                                                             "frame_rate_hz",
                                                             "exposure_us",
                                                             "gain",
                                                             "trigger",
                                                             "strobe_line",
                                                             "ptp",
                                                             "chunks",
                                                             "packet_delay_ns",
                                                             "throughput_bytes_per_s",
                                                             "packet_size_bytes",
                                                             "receive_buffer_bytes",
                                                             "packet_timeout_us",
                                                             "frame_retention_us"};
  return key.section == "log" ||
         (key.section == "camera" && std::ranges::find(kOfTheCamera, key.name) != kOfTheCamera.end());
}

Entries entriesOf(std::vector<capture::Feature>& features) {
  Entries entries;
  entries.get = [&features] {
    std::vector<Entries::Entry> result;
    for (const capture::Feature& feature : features) result.emplace_back(feature.name, feature.value);
    return result;
  };
  entries.add = [&features](Entries::Entry entry) {
    features.push_back({std::move(entry.first), std::move(entry.second)});
  };
  entries.example = "# Each as one { Name = value }, set in the order of the list and read back; a command is { Name = "
                    "true } and is\n"
                    "# waited for. The same name may come again, as for selectors:\n"
                    "# features = [ { UserSetSelector = \"Default\" }, { UserSetLoad = true },\n"
                    "#              { BalanceRatioSelector = \"Red\" }, { BalanceRatio = 1.4 },\n"
                    "#              { BalanceRatioSelector = \"Blue\" }, { BalanceRatio = 1.8 } ]\n";
  return entries;
}

tl::expected<Config, Error> read(tl::expected<TomlTable, FileError> root, bool isStrict = true) {
  if (!root) return tl::unexpected(asError(root.error(), kDefaultsHold));
  Config config;
  return readTable(*root, keysOf(config), isStrict).map([&] {
    if (config.camera.frameRate_Hz > 0.0) config.solve.frameRate_Hz = config.camera.frameRate_Hz;
    return config;
  });
}

}  // namespace

std::vector<Key> keysOf(Config& config) {
  const auto name = [&value = config.sensor.name]() -> std::string {
    return value.empty() || traction::isValidName(value) ? "" : "must be 1 to 24 of A-Z, a-z, 0-9, _ and -";
  };
  const auto endpoints = [&config](const std::vector<std::string>& list) {
    return [&list, &config] { return endpointFault(list, config.insecure); };
  };
  const auto cpus = [&list = config.realtime.cpus] { return parseCpus(list) ? "" : parseCpus(list).error(); };
  capture::CameraOptions& camera = config.camera;
  solve::SolveOptions& solve = config.solve;
  publish::PublishOptions& publish = config.publish;
  RealtimeOptions& realtime = config.realtime;
  using sensor::elastic::Model;

  // clang-format off
  std::vector<Key> keys = {
      {"sensor", "name", "", "Name of the sensor in topics and messages; empty: the name of the instance.",
          &config.sensor.name, {}, name},
      {"sensor", "gel_file", "", "File that describes the gel, such as gels/paper.toml beside this file; empty: that one; \"none\": there is no gel, "
          "and the camera's pictures can be seen; \"adopted\": the one that traction-view --setup has made, and none before.",
          &config.sensor.gelFile},

      {"camera", "id", "", "Device id, Vendor-Serial, IP or MAC address; empty: the first camera found.",
          &camera.id},
      {"camera", "wait", "", "Wait for a camera that is absent; false: its absence is an error.",
          &camera.wait},
      {"camera", "features", "", "Features by their GenICam names, set before all other settings; see below.",
          entriesOf(camera.features)},
      {"camera", "pixel_format", "", "Name in the Pixel Format Naming Convention, such as Mono12p, BayerRG8 or RGB8; empty: the camera's own.",
          &camera.pixelFormat, {}, [&camera] { return pixelFormatFault(camera.pixelFormat); }},
      {"camera", "width_px", "px", "Size of the picture; 0: the camera's own.",
          &camera.width, {0, 65535}},
      {"camera", "height_px", "px", "Size of the picture; 0: the camera's own.",
          &camera.height, {0, 65535}},
      {"camera", "offset_x_px", "px", "Offset of the picture on the sensor; -1: the camera's own.",
          &camera.offsetX, {-1, 65535}},
      {"camera", "offset_y_px", "px", "Offset of the picture on the sensor; -1: the camera's own.",
          &camera.offsetY, {-1, 65535}},
      {"camera", "frame_rate_hz", "frames/s", "0: the camera's own; for --images: as fast as they are tracked.",
          &camera.frameRate_Hz, {0, 10'000}},
      {"camera", "exposure_us", "us", "0: the camera's own.",
          &camera.exposure_us, {0, 10e6}},
      {"camera", "gain", "", "In the camera's own unit; absent: the camera's own.",
          &camera.gain, {-1000, 1e5}},
      {"camera", "trigger", "", "Trigger of each frame: off, software (tractionctl trigger), or a source of the camera: Line1; empty: the camera's own.",
          &camera.trigger},
      {"camera", "strobe_line", "", "Output of the camera that is active during the exposure: Line2; empty: none is set.",
          &camera.strobeLine},
      {"camera", "ptp", "", "Synchronise the camera's clock with the network (IEEE 1588).",
          &camera.ptp},
      {"camera", "chunks", "", "Data that the camera sends with each frame, if it can: ExposureTime, Gain, Timestamp, FrameID, LineStatusAll.",
          &camera.chunks},
      {"camera", "packet_delay_ns", "ns", "Delay between two packets, for several cameras on one link; 0: the camera's own.",
          &camera.packetDelay_ns, {0, 1e7}},
      {"camera", "throughput_bytes_per_s", "bytes/s", "Limit of what the camera sends; 0: the camera's own.",
          &camera.throughput_bytes_per_s, {0, 2e9}},
      {"camera", "packet_size_bytes", "bytes", "Size with headers; 0: the MTU of the interface, at most 9000.",
          &camera.packetSize_bytes, {0, 65'500}},
      {"camera", "receive_buffer_bytes", "bytes", "Buffer of the kernel; 8 MiB hold 150 ms of 640 x 480 RGB8 at 60 frames/s.",
          &camera.receiveBuffer_bytes, {65'536, 1 << 30}},
      {"camera", "packet_timeout_us", "us", "Time without a packet after which a resend is requested.",
          &camera.packetTimeout_us, {100, 1e6}},
      {"camera", "frame_retention_us", "us", "Time without a packet after which a frame is given up.",
          &camera.frameRetention_us, {1000, 10e6}},
      {"camera", "buffers", "frames", "Buffers of the driver; up to 7 are on their way to the tracker.",
          &camera.buffers, {9, 1000}},
      {"camera", "silence_timeout_ms", "ms", "Time without a frame after which the camera is lost; 0: only if the driver reports it.",
          &camera.silenceTimeout_ms, {0, 3'600'000}},
      {"camera", "stills", "", "Use pictures that repeat to the byte, as of a still image; false: five in a row show a source that hangs.",
          &camera.stills},
      {"camera", "fake_interface", "", "Allow the test camera inside the driver.",
          &camera.fakeInterface},

      {"track", "zero_frames", "frames", "Number of frames that a zero averages.",
          &config.track.zeroFrames, {2, 10'000}},
      {"track", "min_valid_fraction", "", "Share of the markers; with fewer, no zero is taken, and fields are flagged.",
          &config.track.minValidFraction, {0.1, 1}},
      {"track", "zero_tracking", "", "Follow the zero while nothing touches, as heat moves it; a load that grows by less than 2 gf in half a minute is lost.",
          &config.track.followsDrift},

      {"solve", "model", "", "Mechanics of the gel: a finite block, or the half-space of the paper.",
          choiceOf(solve.model, {{"block", Model::kBlock}, {"half-space", Model::kHalfSpace}})},
      {"solve", "noise_px", "px", "Noise of a marker's centre in one frame, as calibrated; that of each frame scales the uncertainty.",
          &solve.noise_px, {1e-4, 10}},
      {"solve", "false_alarms_per_hour", "1/h", "Untouched frames that show a touch, by noise alone, at camera.frame_rate_hz as at the start (0: 60 frames/s); "
          "a tenth of them costs 7 % of the smallest press.",
          &solve.falseAlarmsPerHour, {1e-3, 1e5}},
      {"solve", "max_missing_fraction", "", "Share of the markers; with more missing, a field is not valid. Isolated gaps of the zero do not count.",
          &solve.maxMissingFraction, {0, 0.9}},
      {"solve", "min_press_newton", "N", "Normal force above which there is a centre of pressure.",
          &solve.minPressForCentre_N, {0, 1000}},
      {"solve", "patience_ms", "ms", "Longest time that a frame waits for its own solution, where no model of an earlier frame holds; 0: one frame interval.",
          &config.prompt.patience_ms, {0, 1000}},
      {"solve", "models_hz", "models/s", "Most models made in a second, for less load; 0: as many as are wanted.",
          &config.prompt.models_Hz, {0, 1000}},

      {"publish", "insecure", "", "Allow endpoints that other hosts reach: they can then read, take zeros and calibrate.",
          &config.insecure},
      {"publish", "stream", "", "Endpoints of all messages; empty: the instance's own.",
          &publish.stream, {}, endpoints(publish.stream)},
      {"publish", "latest", "", "Endpoints of the newest field alone; empty: the instance's own.",
          &publish.latest, {}, endpoints(publish.latest)},
      {"publish", "control", "", "Endpoints for status, description and zero; empty: the instance's own.",
          &config.controlEndpoints, {}, endpoints(config.controlEndpoints)},
      {"publish", "high_water_mark", "messages", "Messages that may wait for a slow subscriber; further ones are lost for it.",
          &publish.highWaterMark, {1, 100'000}},
      {"publish", "preview_hz", "pictures/s", "Highest rate of reduced pictures, for subscribers to previews; 0: none.",
          &config.preview.rate_Hz, {0, 60}},
      {"publish", "preview_width_px", "px", "Largest width of these pictures.",
          &config.preview.width_px, {16, 1024}},

      {"realtime", "priority", "", "SCHED_FIFO priority of the threads that a frame passes; 0: they run as all others.",
          &realtime.priority, {0, 98}},  // 99 is used by threads of the kernel
      {"realtime", "cpus", "", "Processors that these threads may run on, as a list: 0-2,5; empty: any.",
          &realtime.cpus, {}, cpus},
      {"realtime", "lock_memory", "", "Keep all memory that was touched; it is never swapped out.",
          &realtime.lockMemory},

      {"log", "level", "", "Lowest level of the lines on standard error.",
          choiceOf(config.logLevel, logLevels())},
  };
  // clang-format on
  for (Key& key : keys) key.live = isLive(key);
  return keys;
}

std::vector<Change> changesBetween(const Config& before, const Config& after) {
  Config one = before, other = after;
  return changesBetween(keysOf(one), keysOf(other));
}

std::string configText(const Config& config) {
  Config copy = config, standard;
  return tableText(
      "# Every key of tractiond: its meaning, default, range and unit. Any may be left out.\n"
      "# Those marked \"reload\" can be changed while it runs (systemctl reload, SIGHUP); the others need "
      "a restart.\n"
      "# The instance NAME reads /etc/tractiond/NAME.toml. Its own endpoints are ipc sockets in its "
      "runtime directory,\n"
      "# and for the instance \"default\", control excepted, also tcp on the loopback, ports 9872 and 9873.\n",
      keysOf(copy), keysOf(standard));
}

tl::expected<Config, Error> parseConfig(std::istream& text, const std::string& name) {
  return read(TomlTable::parse(std::string{std::istreambuf_iterator<char>(text), {}}, name));
}

tl::expected<Config, Error> parseRecordedConfig(const std::string& text, const std::string& name) {
  return read(TomlTable::parse(text, name), false);
}

tl::expected<Config, Error> loadConfig(const std::string& path) {
  auto config = read(TomlTable::load(path));
  if (config && config->sensor.namesGelFile()) {
    config->sensor.gelFile = std::filesystem::path(path).parent_path() / config->sensor.gelFile;
  }
  return config;
}

}  // namespace tractiond
