// Options that choose a camera and set its features.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace tractiond::capture {

/// A GenICam feature, by its name in the camera, and its value. `true` executes a command.
struct Feature {
  std::string name;
  std::variant<bool, std::int64_t, double, std::string> value;
};

struct CameraOptions {
  /// Device id, "Vendor-Serial", IP address or MAC address; empty: the first camera found.
  std::string id = {};
  /// File of raw pictures that replaces the camera ("-": standard input); empty: none. From the command line.
  std::string images = {};
  /// Whether to wait for a camera that is not there yet; false: that is an error.
  bool wait = true;

  /// Written before everything else, in the order of the file; commands are executed.
  std::vector<Feature> features = {};

  // Written then, in this order. Zero, empty, or -1 for an offset: not written, the camera keeps its value.
  std::string pixelFormat = {};    ///< a name of base/pixel_format.h
  int width = 0, height = 0;       ///< px
  int offsetX = -1, offsetY = -1;  ///< px
  double frameRate_Hz = 0.0;
  double exposure_us = 0.0;              ///< for any name of the feature; switches automatic exposure off
  std::optional<double> gain = {};       ///< in the camera's own unit; switches automatic gain off
  std::string trigger = {};              ///< "off", "software", or the source's name in the camera: "Line1"
  std::string strobeLine = {};           ///< output line that is active during the exposure: "Line2"
  bool ptp = false;                      ///< true: the camera's clock follows the network's PTP master
  double packetDelay_ns = 0.0;           ///< between two packets of a network camera
  int throughput_bytes_per_s = 0;        ///< upper limit of what the camera sends
  std::vector<std::string> chunks = {};  ///< sent with each frame: "ExposureTime", "Gain", "Timestamp" ...

  /// Size with headers. 0: the interface's MTU, at most 9000; smaller if no whole frame arrives with that.
  int packetSize_bytes = 0;
  /// Holds nine frames of 640 x 480 RGB8: enough for a stall of 150 ms at 60 frames/s.
  int receiveBuffer_bytes = 8 << 20;
  /// Time without a packet of a frame after which a resend is requested, also again. At Aravis's default of 20 ms a
  /// repaired frame is 60 ms late; a camera that pauses for longer is asked for packets that it has not sent yet, and
  /// may then send nothing of that frame again.
  int packetTimeout_us = 5'000;
  /// Time without a packet of a frame after which the frame is given up.
  int frameRetention_us = 100'000;
  /// One fills, the others are in the pipeline. More only add lag when the pipeline stalls.
  int buffers = 10;
  /// Time without a frame after which the camera counts as lost. 0: only if it reports so (a trigger that may pause).
  int silenceTimeout_ms = 2'000;
  /// Whether pictures that are equal to the byte are meant, as of a still that is shown again and again.
  bool stills = false;
  /// Program that evaluates the camera's description in a process of its own first: tractiond's path. Empty: skip this.
  std::string inspector = {};
  /// Whether Aravis's in-process test camera may be opened.
  bool fakeInterface = false;
};

}  // namespace tractiond::capture
