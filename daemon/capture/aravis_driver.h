// A GenICam camera on GigE Vision or USB3 Vision, by way of Aravis.
//
// What Aravis does while pop() runs. In the calling thread: arv_stream_timeout_pop_buffer takes the mutex of a
// GAsyncQueue and waits on its condition; giveBack() takes the mutex of another one and allocates a list node in it, as
// the pop frees one (GLib, 24 bytes). In threads of its own: "arv_gv_stream" receives packets, copies them into the
// buffer and allocates two blocks per frame (its table of packets); "arv_gv_heartbeat" asks for a register every
// second; USB has "libusb_event" and "arv_uv_stream". Aravis logs nothing unless ARV_DEBUG is set.
#pragma once

#include "daemon/capture/camera_options.h"
#include "daemon/capture/driver.h"

#include <memory>

namespace tractiond::capture {

/// Notes when Aravis's receiving thread begins and ends. Both functions are called on that thread.
class ThreadWatch {
 public:
  virtual void enter() = 0;  ///< Is called when the thread begins.
  virtual void leave() = 0;  ///< Is called when the thread ends.

 protected:
  ~ThreadWatch() = default;
};

/// Returns a function that opens the camera, which blocks for seconds; `options` is copied. Exit codes of its errors:
/// EX_UNAVAILABLE (no such camera, or it does not answer, may not be opened, or has a faulty description, or a stop was
/// requested while it was located or inspected), EX_TEMPFAIL (another client holds it and has not left within 8 s, or a
/// stop was requested meanwhile), EX_CONFIG (the camera refuses or lacks a setting, sends a format that cannot be
/// read, or something else than it says), EX_OSERR (the kernel does not take the filters).
/// \param watch may be empty; opening may start several threads in turn
OpenDriver fromAravis(const CameraOptions& options, std::shared_ptr<ThreadWatch> watch = {});

}  // namespace tractiond::capture
