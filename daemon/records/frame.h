// A picture as it travels from the camera to the tracker.
#pragma once

#include "base/pixel_format.h"

#include <cstddef>
#include <cstdint>

namespace tractiond {

/// Which bounds on a frame's capture time hold. The values are those of the messages.
enum class CaptureBound : std::uint8_t {
  kNone,    ///< none
  kBoth,    ///< captured_ns - capturedError_ns and captured_ns + capturedError_ns
  kLatest,  ///< only the upper one; the true time is earlier by the shortest delay from camera to host, not known
};

/// When a frame was made and when it reached each stage. CLOCK_MONOTONIC and CLOCK_REALTIME are of the daemon's host.
/// Zero means unknown.
struct FrameTimes {
  std::int64_t device_ns = 0;         ///< the camera's own clock, as sent; the camera defines its epoch
  std::int64_t received_ns = 0;       ///< CLOCK_MONOTONIC when the frame was popped from the camera driver
  std::int64_t receivedReal_ns = 0;   ///< CLOCK_REALTIME at the same moment
  std::int64_t captured_ns = 0;       ///< when the picture was taken, on CLOCK_MONOTONIC (capture::CaptureClock)
  std::int64_t capturedError_ns = 0;  ///< half width of the uncertainty of captured_ns
  CaptureBound capturedBound = CaptureBound::kNone;  ///< which bounds hold
  std::int64_t tracked_ns = 0;                       ///< CLOCK_MONOTONIC when tracking was done
  std::int64_t solved_ns = 0;                        ///< CLOCK_MONOTONIC when solving was done

  bool operator==(const FrameTimes&) const = default;
};

/// Data that a camera may send beside the picture (its chunk data).
struct FrameExtras {
  double exposure_s = 0.0;     ///< 0: not sent
  double gain = 0.0;           ///< in the camera's own unit
  std::uint64_t lines = 0;     ///< levels of the camera's lines, line 0 in the lowest bit
  float temperature_C = 0.0F;  ///< as the camera said last, not with this picture
  bool hasGain = false, hasLines = false, hasTemperature = false;

  bool operator==(const FrameExtras&) const = default;
};

struct FrameInfo {
  std::uint64_t cameraFrameId = 0;  ///< as the camera counts (16 bit on GigE Vision 1.x: it wraps)
  std::uint64_t frameNumber =
      0;  ///< counted up from the start of the daemon; jumps where the camera's ids say frames were lost
  double exposure_s = 0.0;  ///< as sent with the frame, else as set; 0: the camera does not report it
  FrameExtras extras;
  bool discontinuity = false;  ///< the ids or the clock jumped since the frame before: positions may have moved far
  bool doubted = false;        ///< the picture may come from another sender: kDoubtedOrigin
  FrameTimes times;

  bool operator==(const FrameInfo&) const = default;
};

/// A borrowed picture. The memory belongs to the frame source and is valid until the frame is given back.
struct Frame {
  FrameInfo info;
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;       ///< bytes
  int width = 0, height = 0;  ///< px
  int stride = 0;             ///< bytes from row to row; 0: rows begin within bytes, with no gaps
  PixelFormat format = PixelFormat::kRgb8;
  void* token = nullptr;  ///< the source's own handle of the memory
  unsigned session = 0;   ///< session of the source, from its opening to the next, in which the handle is valid
};

}  // namespace tractiond
