// How a camera is chosen and set.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace tractiond::capture {

enum class PacketSocket { kOff, kAuto, kOn };

/// A GenICam feature by its name in the camera. `true` for a command executes it.
struct Feature {
  std::string name;
  std::variant<bool, std::int64_t, double, std::string> value;
};

struct CameraOptions {
  /// Device id, "Vendor-Serial", IP address or MAC address; empty: the first camera found.
  std::string id = {};
  /// Raw pictures from this file ("-": standard input) take a camera's place; empty: they do not. From the command
  /// line.
  std::string images = {};
  /// A camera that is not there yet is waited for; false: that is an error.
  bool wait = true;

  /// First of all, in the order of the file: any sequence, commands included.
  std::vector<Feature> features = {};

  // Then these in their order. Zero, empty, or -1 for an offset: as the camera stands.
  std::string pixelFormat = {};    ///< a name of records/pixel_format.h
  int width = 0, height = 0;       ///< px
  int offsetX = -1, offsetY = -1;  ///< px
  double frameRate_Hz = 0.0;
  double exposure_us = 0.0;              ///< whatever the camera's name for it; switches its automatic off
  std::optional<double> gain = {};       ///< in the camera's own unit; likewise
  std::string trigger = {};              ///< "off", "software", or the source's name in the camera: "Line1"
  std::string strobeLine = {};           ///< follows the exposure: "Line2"
  bool ptp = false;                      ///< the camera's clock follows its network's
  double packetDelay_ns = 0.0;           ///< between two packets of a network camera
  int throughput_bytes_per_s = 0;        ///< that the camera sends at most
  std::vector<std::string> chunks = {};  ///< sent with each frame: "ExposureTime", "Gain", "Timestamp" ...

  /// With headers. 0: the interface's MTU, at most 9000; smaller if no whole frame arrives so.
  int packetSize_bytes = 0;
  /// Nine frames of 640 x 480 RGB8: rides out a stall of 150 ms at 60 frames/s.
  int receiveBuffer_bytes = 8 << 20;
  /// A packet that was asked for again and has not come, or a frame that goes on no more, is asked for after this. At
  /// Aravis's default of 20 ms a repaired frame is 60 ms late; a camera that pauses for longer is asked for what it has
  /// not sent yet, and may then send nothing of that frame again.
  int packetTimeout_us = 5'000;
  /// A frame whose packets stay away for longer is given up.
  int frameRetention_us = 100'000;
  /// Needs CAP_NET_RAW, and delivers late or nothing on loopback.
  PacketSocket packetSocket = PacketSocket::kOff;
  /// One fills, the others are in the pipeline. More only add lag when it stalls.
  int buffers = 10;
  /// Without a frame for longer the camera counts as lost. 0: only if it says so (a trigger that may pause).
  int silenceTimeout_ms = 2'000;
  /// Evaluates the camera's description first, in a process of its own: tractiond's path. Empty: nobody does.
  std::string inspector = {};
  /// Aravis's in-process test camera may be opened.
  bool fakeInterface = false;
};

}  // namespace tractiond::capture
