// Owns what differs between the versions of Aravis that this program builds with: 0.8.26 (Debian 12), 0.8.34 (Debian
// 13), and the API 0.10 (0.9.3). No other file asks for the version. Functions as Aravis's own of similar names.
#pragma once

#include <arv.h>

namespace tractiond::aravis {

/// The type of the data that ArvDeviceClass::write_memory is given.
#if ARAVIS_CHECK_VERSION(0, 8, 32)
using WriteMemoryData = const void*;
#else
using WriteMemoryData = void*;
#endif

/// Opens the stream of a camera. Returns nullptr with `error` set if that fails.
inline ArvStream* createStream(ArvCamera* camera, ArvStreamCallback callback, void* data, GError** error) {
#if ARAVIS_CHECK_VERSION(0, 9, 0)
  return arv_camera_create_stream(camera, callback, data, nullptr, error);
#else
  return arv_camera_create_stream(camera, callback, data, error);
#endif
}

/// Stops the thread that receives a stream's packets; its buffers stay where they are.
inline void stopReceiving(ArvStream* stream) {
#if ARAVIS_CHECK_VERSION(0, 9, 0)
  arv_stream_stop_acquisition(stream, nullptr);
#else
  arv_stream_stop_thread(stream, FALSE);
#endif
}

/// Starts it again.
inline void startReceiving(ArvStream* stream) {
#if ARAVIS_CHECK_VERSION(0, 9, 0)
  arv_stream_start_acquisition(stream, nullptr);
#else
  arv_stream_start_thread(stream);
#endif
}

/// Makes a fake camera call fill(buffer, data, exposure_us, gain, format) for each picture, on Aravis's thread. `data`
/// must outlive the camera.
inline void setFillPattern(ArvFakeCamera* camera, ArvFakeCameraFillPattern fill, void* data) {
#if ARAVIS_CHECK_VERSION(0, 9, 1)
  arv_fake_camera_set_fill_pattern(camera, fill, data, nullptr);
#else
  arv_fake_camera_set_fill_pattern(camera, fill, data);
#endif
}

}  // namespace tractiond::aravis
