#include "daemon/config.h"

#include "daemon/records/pixel_format.h"
#include "proto/traction/v1/endpoints.h"

namespace tractiond {
namespace {

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

std::string pixelFormatFault(const std::string& name) {
  if (name.empty() || pixelFormatByName(name) != nullptr) return "";
  return quoted(name) + " is none that can be read: " + std::string(kPixelFormatsInWords);
}

/// What the picture is, and where the gel is in it, stays: the zero rests on it.
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
  using capture::PacketSocket;
  using sensor::elastic::Model;

  // clang-format off
  std::vector<Key> keys = {
      {"sensor", "name", "", "Of the sensor, in topics and messages; empty: the name of the instance.",
          &config.sensor.name, {}, name},
      {"sensor", "gel_file", "", "What the sensor is made of, see gels/paper.toml beside this file; empty: as there; \"none\": there is no gel, and "
          "the camera's pictures can be seen.",
          &config.sensor.gelFile},

      {"camera", "id", "", "Device id, Vendor-Serial, IP or MAC address; empty: the first camera found.",
          &camera.id},
      {"camera", "wait", "", "A camera that is not there yet is waited for; false: that is an error.",
          &camera.wait},
      {"camera", "features", "", "First of all: any features by their GenICam names, see below.",
          entriesOf(camera.features)},
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
      {"camera", "frame_rate_hz", "frames/s", "0: as the camera stands; of --images: as fast as they are tracked.",
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
          choiceOf(camera.packetSocket,
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
          choiceOf(solve.model, {{"block", Model::kBlock}, {"half-space", Model::kHalfSpace}})},
      {"solve", "solver", "", "What forces are solved with. Experimental: one statistical model of all contacts, which is slower.",
          choiceOf(solve.solving, {{"contact-step", solve::Solving::kContactStep}, {"model", solve::Solving::kModel}})},
      {"solve", "regularisation", "", "Tikhonov's, relative to the largest singular value of the influence matrix.",
          &solve.regularisation, {1e-6, 1}},
      {"solve", "contact_aware", "", "Solve for the nodes alone that carry something, where the contact is small enough.",
          &solve.contactAware},
      {"solve", "noise_px", "px", "Of a marker's centre in one frame; what the search for contacts reckons with.",
          &solve.noise_px, {1e-4, 10}},
      {"solve", "force_scale_newton", "N", "Usual force of a node in the contact step, at least; stronger contacts raise it.",
          &solve.forceScale_N, {1e-6, 1000}},
      {"solve", "max_missing_fraction", "", "Of the markers; with more missing the field is not valid. Isolated gaps of the zero do not count.",
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
      {"publish", "preview_hz", "pictures/s", "Reduced pictures for who subscribes to them, at most; 0: none.",
          &config.preview.rate_Hz, {0, 60}},
      {"publish", "preview_width_px", "px", "Of these pictures, at most.",
          &config.preview.width_px, {16, 1024}},

      {"realtime", "priority", "", "SCHED_FIFO, of the threads that a frame passes, above all that is no real-time thread; 0: run as those.",
          &realtime.priority, {0, 98}},  // 99 is that of the kernel's own
      {"realtime", "cpus", "", "Processors that these threads may run on, as a list: 0-2,5; empty: any.",
          &realtime.cpus, {}, cpus},
      {"realtime", "lock_memory", "", "What has been touched stays in memory, and is never swapped out.",
          &realtime.lockMemory},

      {"log", "level", "", "Of what goes to standard error.",
          choiceOf(config.logLevel, {"debug", "info", "warning", "error"})},
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

}  // namespace tractiond
