// A GenICam camera on GigE Vision or USB3 Vision, by way of Aravis.
//
// What Aravis does while next() runs. In the calling thread: arv_stream_timeout_pop_buffer takes the mutex of a
// GAsyncQueue and waits on its condition; recycle() takes the mutex of another one and allocates a list node in it, as
// the pop frees one (GLib, 24 bytes). In threads of its own: "arv_gv_stream" receives packets, copies them into the
// buffer and allocates two blocks per frame (its table of packets); "arv_gv_heartbeat" asks for a register every
// second; USB has "libusb_event" and "arv_uv_stream". Aravis logs nothing unless ARV_DEBUG is set.
//
// One thread of ours, "camera-keeper", exists only while a camera is torn down (Aravis blocks for seconds in each call
// to a dead one) and opened anew; next() times out meanwhile.
#pragma once

#include "daemon/base/error.h"
#include "daemon/capture/camera_info.h"
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
#include <thread>

namespace tractiond::capture {

/// Thread-bound, but for info().
class AravisCamera : public FrameSource {
 public:
  /// Told that the camera is lost, what keeps it away (once per reason), and that it is back. Called by open(), next()
  /// and the camera-keeper: thread-safe.
  using Say = std::function<void(const std::string& line)>;

  /// Waits for the camera if the options say so. Exit codes of the errors: EX_UNAVAILABLE (no such camera, or it does
  /// not answer), EX_TEMPFAIL (another client holds it; one that died loses it within some seconds, 8 s are waited),
  /// EX_CONFIG (it refuses a setting, or lacks it), EX_NOPERM (a packet socket is not allowed), EX_OK (`stop` was
  /// asked). The ledger must outlive the camera.
  static tl::expected<std::unique_ptr<AravisCamera>, Error> open(const CameraOptions& options, Ledger& ledger,
                                                                 const std::stop_token& stop = {}, Say say = {});
  /// Every frame must have been recycled. Takes half a second at most, whatever the camera does.
  ~AravisCamera() override;

  Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override;

  /// Of the first opening: the camera comes back with the same picture, or not at all.
  const CameraInfo& info() const { return info_; }

  /// It was there and is gone; it is being opened anew. For the status.
  bool lost() const { return session_ == nullptr; }

 private:
  struct Session;
  struct Keeper;
  AravisCamera(const CameraOptions& options, Ledger& ledger, Say say, std::unique_ptr<Session> session);

  Next judge(Frame& frame, void* handle);
  void giveUp(const std::stop_source& stop = std::stop_source());
  bool adopt(std::chrono::milliseconds timeout);

  CameraOptions options_;
  Ledger& ledger_;
  Say say_;
  CameraInfo info_;
  FrameGate gate_;
  DeviceClock clock_;
  std::unique_ptr<Session> session_;  ///< none while the keeper is at work
  std::shared_ptr<Keeper> keeper_;    ///< shared with its thread
  std::thread keeperThread_;
  std::int64_t lastArrival_ns_ = 0;
};

}  // namespace tractiond::capture
