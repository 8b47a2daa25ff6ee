// A GigE Vision camera on a local address that sends given pictures.
#pragma once

#include "base/error.h"
#include "twin/format.h"

#include <tl/expected.hpp>

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace twin {

/// Time and id with which a picture was sent.
struct Stamp {
  std::uint64_t cameraFrameId;  ///< as sent: 16 bit, never 0
  std::int64_t device_ns;       ///< as sent: CLOCK_REALTIME of this host, in whole microseconds
  std::int64_t monotonic_ns;    ///< CLOCK_MONOTONIC just before the first packet was sent
};

/// A picture to send.
struct Picture {
  Format format = Format::kRgb8;
  std::vector<std::uint8_t> pixels;  ///< as many as the camera's width and height need: this is not checked
  std::uint64_t number = 0;          ///< for the caller's use
  double time_s = 0.0;               ///< for the caller's use
  std::optional<Stamp> stamp;        ///< set when the picture was sent
};

struct GvCameraOptions {
  std::string address = "127.0.0.1";  ///< a local IPv4 address; the port is 3956
  int width = 640, height = 480;      ///< [px]
  Format format = Format::kRgb8;      ///< until a client chooses another one
  double rate_hz = 60.0;              ///< until a client chooses another one
  double lostRatio = 0.0;             ///< share of the stream's packets that are not sent
};

/// Serves pictures through Aravis's fake camera, which asks for a picture when one is due: on a thread of its own,
/// while it answers no other packet. Pictures are therefore drawn ahead and only copied there. Without a client no
/// picture is used; to a client that chooses a pixel format that is not one of formats(), zeros are sent. Thread-safe,
/// except for close().
class GvCamera {
 public:
  /// Starts the camera. Error: EX_UNAVAILABLE if no interface that is up has exactly this address, or port 3956 is in
  /// use on it or on 255.255.255.255.
  static tl::expected<std::unique_ptr<GvCamera>, tractiond::Error> open(const GvCameraOptions& options);
  /// Blocks until Aravis's thread has ended. Pictures that are still queued are not touched any more.
  ~GvCamera();

  /// Queues the next picture to send and resets its stamp; a picture of another format than format() is discarded. Does
  /// not wait. The caller keeps ownership and must not touch it until takeBack() returns it.
  void queue(Picture& picture);

  /// Waits for a queued picture that is finished: sent, or without a stamp if it was discarded because the client chose
  /// another format. Returns null after the timeout.
  Picture* takeBack(std::chrono::milliseconds timeout);

  /// Ends sending, and blocks until Aravis's thread has ended. That thread may wait for one more picture, which another
  /// thread must queue. Sent pictures can still be taken back.
  void close();

  /// Returns the format that queued pictures must have: the client's choice at the last picture, else the options'.
  Format format() const;
  double framePeriod_s() const;                  ///< Returns the client's choice at the last picture, else 1 / rate_hz.
  const std::string& id() const { return id_; }  ///< Returns "VENDOR-SERIAL", by which a client finds this camera.

 private:
  explicit GvCamera(const GvCameraOptions& options);

  // Run on Aravis's thread.
  void fill(void* buffer, std::uint32_t pixelFormat);  ///< \param buffer of Aravis
  const Picture* waitFor(Format format);
  void sent(const Stamp& stamp);
  void copyRegion(const Picture& picture, int x, int y, int width, int height, std::uint8_t* to) const;

  const int width_, height_;
  void* camera_ = nullptr;  ///< of Aravis
  std::string id_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool isClosing_ = false;
  Format format_;
  std::uint32_t period_us_;
  std::deque<Picture*> queued_, returned_;
};

}  // namespace twin
