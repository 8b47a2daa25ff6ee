// Options by which a camera is chosen and set.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace tractiond::capture {

enum class PacketSocket { kOff, kAuto, kOn };

/// A GenICam feature, by its name in the camera, and its value. `true` executes a command.
struct Feature {
  std::string name;
  std::variant<bool, std::int64_t, double, std::string> value;
};

struct CameraOptions {
  /// Device id, "Vendor-Serial", IP address or MAC address; empty: the first camera found.
  std::string id = {};
  /// File of raw pictures that replaces a camera ("-": standard input); empty: a camera is used. Set by the command
  /// line.
  std::string images = {};
  /// Whether to wait for a camera that is absent; false: its absence is an error.
  bool wait = true;

  /// Written before all other settings, in the order of the configuration, commands included.
  std::vector<Feature> features = {};

  // Written next, in this order. Zero, empty, or -1 for an offset: the camera's own value is kept.
  std::string pixelFormat = {};    ///< a name of records/pixel_format.h
  int width = 0, height = 0;       ///< px
  int offsetX = -1, offsetY = -1;  ///< px
  double frameRate_Hz = 0.0;
  double exposure_us = 0.0;              ///< under any name that cameras use; switches automatic exposure off
  std::optional<double> gain = {};       ///< in the camera's own unit; switches automatic gain off
  std::string trigger = {};              ///< "off", "software", or the source's name in the camera: "Line1"
  std::string strobeLine = {};           ///< output that is active during the exposure: "Line2"
  bool ptp = false;                      ///< synchronises the camera's clock with its network (IEEE 1588)
  double packetDelay_ns = 0.0;           ///< between two packets of a network camera
  int throughput_bytes_per_s = 0;        ///< limit of what the camera sends; 0: the camera's own
  std::vector<std::string> chunks = {};  ///< sent with each frame: "ExposureTime", "Gain", "Timestamp" ...

  /// With headers. 0: the interface's MTU, at most 9000; smaller if no whole frame arrives with it.
  int packetSize_bytes = 0;
  /// Default: nine frames of 640 x 480 RGB8, enough for a stall of 150 ms at 60 frames/s.
  int receiveBuffer_bytes = 8 << 20;
  /// Time after which a resend request is repeated, or the rest of a frame that has stopped is requested. With Aravis's
  /// default of 20 ms a repaired frame is 60 ms late. A camera that pauses for longer within a frame gets requests for
  /// packets that it has not sent yet, and may then send nothing more of that frame.
  int packetTimeout_us = 5'000;
  /// Time without a packet after which a frame is given up.
  int frameRetention_us = 100'000;
  /// Needs CAP_NET_RAW. On a loopback interface it delivers late or not at all.
  PacketSocket packetSocket = PacketSocket::kOff;
  /// One is being filled, the others are in the pipeline. More of them only add delay after a stall.
  int buffers = 10;
  /// Time without a frame after which the camera counts as lost; 0: it is lost only if the driver reports it, for
  /// triggers that may pause.
  int silenceTimeout_ms = 2'000;
  /// Path of tractiond, which evaluates the camera's description in a child process first; empty: not evaluated.
  std::string inspector = {};
  /// Whether Aravis's in-process test camera may be opened.
  bool fakeInterface = false;
};

}  // namespace tractiond::capture
