// Interface of a driver, which opens a source of pictures, pops buffers, takes them back and closes the source: Aravis,
// pictures in memory, a pipe. camera.h makes a source of frames of any of them.
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

/// One buffer as the driver delivered it, intact or not.
struct Buffer {
  Arrival arrival;
  const std::uint8_t* data = nullptr;  ///< valid if the buffer is complete
  int stride = 0;                      ///< bytes from row to row
  FrameExtras extras;                  ///< what the camera sent beside the picture
  bool awaited = false;                ///< it arrived while pop() waited: the queue was empty before
  void* handle = nullptr;
};

enum class Popped {
  kBuffer,
  kNothing,  ///< nothing arrived in time
  kGone,     ///< the camera is lost, or another client controls it
  kEnd,      ///< the source has ended: a file, a pipe
};

/// An opened camera. pop(), giveBack() and takeClock() are called by the capture thread; link(), serve() and the
/// destructor by the thread "camera-calls", as they may take seconds if the camera is gone; all others by the
/// camera-keeper, also during one of those calls.
class Driver {
 public:
  virtual ~Driver() = default;  ///< Closes the source. May block for seconds if the camera is gone.

  virtual const CameraInfo& info() const = 0;

  /// Waits at most `timeout` for a buffer. Allocates nothing, takes no lock of ours, logs nothing.
  virtual Popped pop(Buffer& buffer, std::chrono::milliseconds timeout) = 0;
  virtual void giveBack(void* handle) = 0;

  /// Takes the newest reading of the camera's clock. Returns false if there is no new one, or the clock is not read.
  /// Does not wait.
  virtual bool takeClock(ClockFit& /*fit*/) { return false; }

  /// Releases a buffer that is given back after its driver has been destroyed.
  using Discard = void (*)(void* handle);
  virtual Discard discard() const = 0;

  /// Returns why the source has ended, after kEnd; EX_OK: all pictures were delivered.
  virtual Error end() const { return {.exitCode = EX_OK}; }

  /// Liveness check, when no picture arrives. Returns why the camera is to be given up, in words; empty: it answers, or
  /// cannot be asked. Takes 0.4 s at most.
  virtual std::string doubt() { return ""; }

  /// Marks the camera as silent: the destructor does not ask it to stop, and link() reads no further register. Any
  /// thread.
  virtual void markSilent() {}

  /// Restores the values that opening the camera has changed, except for the effects of commands. The driver must not
  /// be used after that. May block.
  virtual void undo() {}

  /// Returns the state of the link. Counts of packets are added to `before`, the state at the end of the last session.
  /// May block.
  virtual CameraLink link(const CameraLink& /*before*/) { return {}; }

  /// Serves an operator's request while the camera streams. Returns a sentence if it cannot be served. May block.
  virtual tl::expected<CameraReport, std::string> serve(const CameraStep& /*step*/) {
    return tl::unexpected<std::string>("this source of pictures has no features");
  }
};

/// Level of a line for the log.
enum class LogLevel { kInfo, kWarning };
using Say = std::function<void(LogLevel, const std::string& line)>;

/// How a driver is to be opened.
struct Opening {
  const CameraInfo* before =
      nullptr;      ///< the last session, whose camera and picture are required; nullptr: this is the first
  int attempt = 0;  ///< number of attempts since then
  std::stop_token stop = {};
  Say say = {};
  std::function<void()> found = {};  ///< called when a camera has been found, before it is set up
};

/// Opens a driver; blocks. Exit codes of the errors: EX_UNAVAILABLE if the source is absent or does not answer, and
/// another try may succeed; EX_OK if a stop was requested; all others if a new try would fail as well.
using OpenDriver = std::function<tl::expected<std::unique_ptr<Driver>, Error>(const Opening&)>;

}  // namespace tractiond::capture
