// One half of a source of pictures: whatever opens, pops, gives back and closes. Aravis is one; memory and pipes are
// others. The other half, camera.h, is the same for all of them.
#pragma once

#include "base/error.h"
#include "daemon/capture/camera_info.h"
#include "daemon/capture/clock_fit.h"
#include "daemon/capture/frame_gate.h"
#include "daemon/records/camera.h"
#include "daemon/records/camera_features.h"
#include "daemon/records/frame.h"

#include <tl/expected.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>

namespace tractiond::capture {

/// One buffer as it came, good or bad.
struct Buffer {
  Arrival arrival;
  const std::uint8_t* data = nullptr;  ///< of a complete one
  int stride = 0;                      ///< bytes from row to row
  FrameExtras extras;                  ///< what the camera sent beside the picture
  bool awaited = false;                ///< it came while pop() waited: nothing was queued before it
  void* handle = nullptr;
};

enum class Popped {
  kBuffer,
  kNothing,  ///< in time
  kGone,     ///< the camera is no longer ours
  kEnd,      ///< there will be no more, by nature
};

/// An opened camera. pop(), giveBack() and takeClock() are called by the capture thread; link(), serve() and the
/// destructor by the thread "camera-calls", as they may take seconds where the camera is gone; all else by the
/// camera-keeper, also while one of those calls lasts.
class Driver {
 public:
  virtual ~Driver() = default;  ///< closes; may block for seconds where the camera is dead

  virtual const CameraInfo& info() const = 0;

  /// Allocates nothing, takes no lock of ours, logs nothing.
  virtual Popped pop(Buffer& buffer, std::chrono::milliseconds timeout) = 0;
  virtual void giveBack(void* handle) = 0;

  /// What the camera's clock showed lately; false: nothing new, or it is not asked. Waits for nobody.
  virtual bool takeClock(ClockFit& /*fit*/) { return false; }

  /// What becomes of a buffer that is given back when its driver is gone.
  using Discard = void (*)(void* handle);
  virtual Discard discard() const = 0;

  /// Why it ended: after kEnd. EX_OK: that was all.
  virtual Error end() const { return {.exitCode = EX_OK}; }

  /// No picture comes: why it is given up, in words; empty: the camera is there, or cannot be asked. Takes four tenths
  /// of a second at most.
  virtual std::string doubt() { return ""; }

  /// The camera has fallen silent: it is not asked to stop when this is destroyed, and link() reads no further
  /// register. Any thread.
  virtual void markSilent() {}

  /// Puts back what opening it has set, but for what commands have done; it is not used after that. May block.
  virtual void undo() {}

  /// Returns the state of the link. Packets are counted on from `before`, the state at the end of the session before.
  /// May block.
  virtual CameraLink link(const CameraLink& /*before*/) { return {}; }

  /// What people ask of a camera while it streams; a sentence where it cannot be done. May block.
  virtual tl::expected<CameraReport, std::string> serve(const CameraStep& /*step*/) {
    return tl::unexpected<std::string>("this source of pictures has no features");
  }
};

/// What people should read of a camera.
enum class Weight { kInfo, kWarning };
using Say = std::function<void(Weight, const std::string& line)>;

/// How a driver is to be opened.
struct Opening {
  const CameraInfo* before = nullptr;  ///< the session before: the same camera and picture are wanted; none: the first
  int attempt = 0;                     ///< since that, from 0 on
  std::stop_token stop = {};
  Say say = {};
  std::function<void()> found = {};  ///< to be called when a camera is there, before it is set up
};

/// Blocks. Exit codes of the errors: EX_UNAVAILABLE (it is not there, or does not answer: worth another try), all
/// others (a new try would fail as well), EX_OK (stop was asked).
using OpenDriver = std::function<tl::expected<std::unique_ptr<Driver>, Error>(const Opening&)>;

}  // namespace tractiond::capture
