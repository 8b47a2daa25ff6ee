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

namespace tractiond::capture {

/// Exit codes of its errors: EX_UNAVAILABLE (no such camera, or it does not answer), EX_TEMPFAIL (another client holds
/// it; one that died loses it within some seconds, 8 s are waited), EX_CONFIG (it refuses a setting, or lacks it),
/// EX_NOPERM (a packet socket, or the USB device, is not allowed).
/// \param receiving called by Aravis's thread that receives, with true when it begins and false when it ends
OpenDriver fromAravis(const CameraOptions& options, const std::function<void(bool)>& receiving = {});

}  // namespace tractiond::capture
