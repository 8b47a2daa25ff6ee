// A GigE Vision camera on a local address that sends the pictures it is given.
#pragma once

#include "twin/failure.h"
#include "twin/format.h"

#include <tl/expected.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace twin {

/// When and under which id a picture went out.
struct Stamp {
  std::uint64_t cameraFrameId;  ///< as on the wire: 16 bit, never 0
  std::int64_t device_ns;       ///< as on the wire: this host's CLOCK_REALTIME in whole microseconds
  std::int64_t monotonic_ns;    ///< CLOCK_MONOTONIC just before the first packet
};

struct Picture {
  Format format = Format::kRgb8;
  std::vector<std::uint8_t> pixels;  ///< rows without padding
  std::uint64_t number = 0;          ///< the caller's
  double time_s = 0.0;               ///< the caller's
  std::optional<Stamp> stamp;        ///< set when it was sent
};

struct GvCameraOptions {
  std::string address = "127.0.0.1";  ///< a local IPv4 address; the port is always 3956
  int width = 640, height = 480;      ///< [px]
  Format format = Format::kRgb8;      ///< a client may choose another one
  double rate_hz = 60.0;              ///< a client may choose another one
  double lostRatio = 0.0;             ///< share of the stream's packets that are not sent
};

/// Aravis's fake camera asks for a picture when one is due, in its own thread, under a lock and while it answers no
/// other packet: pictures are drawn ahead and only copied there. Without a client nothing is sent and no picture is
/// used up. Thread-safe.
class GvCamera {
 public:
  static tl::expected<std::unique_ptr<GvCamera>, Failure> open(const GvCameraOptions& options);
  ~GvCamera();

  /// The next picture to send; it stays the caller's and must not be touched until it comes back.
  void queue(Picture& picture);

  /// A queued picture that was sent; or one without a stamp, which was not, because the client has chosen another
  /// format. Null after the time.
  Picture* takeBack(std::chrono::milliseconds timeout);

  /// Sends no more. Meanwhile one more picture may be due, and must be queued. What was sent can still be taken back.
  void close();

  Format format() const;          ///< that the client expects
  double framePeriod_s() const;   ///< that the client expects
  const std::string& id() const;  ///< vendor, dash, serial: how a client finds this camera

 private:
  class Impl;
  explicit GvCamera(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace twin
