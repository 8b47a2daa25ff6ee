// A GenICam camera on GigE Vision or USB3 Vision, by way of Aravis.
//
// What Aravis does while next() runs. In the calling thread: arv_stream_timeout_pop_buffer takes the mutex of a
// GAsyncQueue and waits on its condition; recycle() takes the mutex of a second one and allocates a list node in it
// (GLib's slice, 24 bytes), as the pop frees one. In Aravis's own threads: "arv_gv_stream" receives packets, copies
// them into the buffer and allocates two blocks per frame (its table of packets); "arv_gv_heartbeat" asks for a
// register every second. Logging of Aravis is off unless ARV_DEBUG is set.
//
// A thread of ours, "camera-keeper", exists only while a lost camera is torn down (Aravis blocks for seconds in each
// call) and opened anew; next() times out meanwhile.
#pragma once

#include "daemon/base/error.h"
#include "daemon/capture/camera_options.h"
#include "daemon/capture/device_clock.h"
#include "daemon/capture/frame_gate.h"
#include "daemon/capture/frame_source.h"
#include "daemon/records/ledger.h"

#include <tl/expected.hpp>

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

namespace tractiond::capture {

/// A camera as Aravis sees it.
struct CameraName {
  std::string id, physicalId, address, vendor, model, serial, protocol;
};

/// All cameras in sight; looks for about a second. `withFake` includes Aravis's in-process test camera.
std::vector<CameraName> listCameras(bool withFake = false);

/// What was agreed upon when the camera was opened.
struct CameraInfo {
  CameraName name;
  int width = 0, height = 0;  ///< px
  PixelFormat format = PixelFormat::kRgb8;
  double frameRate_Hz = 0.0;          ///< 0: the camera does not tell
  double exposure_s = 0.0;            ///< 0: the camera does not tell
  int packetSize_bytes = 0;           ///< 0: not a network camera
  bool packetSizeVerified = false;    ///< a whole frame has arrived with it
  bool packetSocket = false;          ///< frames are read from a packet socket instead of the normal one
  int receiveBuffer_bytes = 0;        ///< as the kernel granted it; 0: there is none
  std::vector<std::string> settings;  ///< every feature as read back: "Name = value"
  std::vector<std::string> warnings;  ///< one line each, with the remedy
};

/// Thread-bound, but for info().
class AravisCamera : public FrameSource {
 public:
  using Say = std::function<void(const std::string& warning)>;  ///< called by the camera-keeper; must be thread-safe

  /// Waits for the camera if the options say so. Exit codes of the errors: EX_UNAVAILABLE (no such camera, or it does
  /// not answer), EX_TEMPFAIL (another client holds it, and did not leave within 5 s, longer than the heartbeat of a
  /// client that died), EX_CONFIG (it refuses a setting, or lacks it), EX_NOPERM (a packet socket is not allowed),
  /// EX_OK (`stop` was asked while waiting). The options, the ledger and `say` must outlive the camera.
  static tl::expected<std::unique_ptr<AravisCamera>, Error> open(const CameraOptions& options, Ledger& ledger,
                                                                 std::stop_token stop = {}, Say say = {});
  ~AravisCamera() override;

  Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override;

  /// Of the first opening; the camera comes back with the same picture or not at all.
  const CameraInfo& info() const { return info_; }

  /// It was there and is gone; it is being opened anew.
  bool lost() const { return session_ == nullptr; }

 private:
  struct Session;
  struct Keeper;
  AravisCamera(const CameraOptions& options, Ledger& ledger, Say say, std::unique_ptr<Session> session);

  Next fill(Frame& frame, void* buffer);
  void lose();
  bool adopt(std::chrono::milliseconds timeout);

  const CameraOptions& options_;
  Ledger& ledger_;
  Say say_;
  CameraInfo info_;
  FrameGate gate_;
  DeviceClock clock_;
  std::unique_ptr<Session> session_;  ///< null while the keeper is at work
  std::unique_ptr<Keeper> keeper_;
  std::int64_t lastArrival_ns_ = 0;
};

}  // namespace tractiond::capture
