// Interface of what delivers buffers with pictures: a camera by Aravis, pictures in memory, a pipe. camera.h makes
// frames of them, in the same way for all.
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
  const std::uint8_t* data = nullptr;  ///< the picture, valid until giveBack(); null: incomplete, or no picture
  int stride = 0;                      ///< bytes from row to row
  FrameExtras extras;                  ///< what the camera sent beside the picture
  bool awaited = false;                ///< it came while pop() waited: nothing was queued before it
  void* handle = nullptr;              ///< for giveBack()
};

enum class Popped {
  kBuffer,
  kNothing,  ///< no buffer came within the timeout
  kGone,     ///< this process no longer controls the camera
  kBroken,   ///< the first frames of the session were not whole: opening the camera again may tell why
  kEnd,      ///< there will be no more buffers, as at the end of a file; see end()
};

/// An opened camera. The capture thread calls pop(), giveBack(), takeClock(), markSilent(), discard() and end(); the
/// thread "camera-calls" calls link(), serve() and the destructor, as they may take seconds if the camera is gone; the
/// camera-keeper calls doubt(), also while one of those calls lasts, objection() and undo(), and destroys a driver that
/// is never lent. info() is for any thread.
class Driver {
 public:
  virtual ~Driver() = default;  ///< Closes the camera; may block for seconds if it does not answer.

  /// Returns what was agreed upon when the camera was opened; it does not change. `session` is 0: the keeper counts.
  virtual const CameraInfo& info() const = 0;

  /// Waits at most `timeout` for the next buffer, intact or not. Fills `buffer` if it returns kBuffer; the caller must
  /// then give it back; else its content has no meaning. Allocates nothing, takes no lock of this program, logs
  /// nothing.
  virtual Popped pop(Buffer& buffer, std::chrono::milliseconds timeout) = 0;
  /// Gives a buffer back for reuse; each must be given back once, in any order.
  /// \param handle Buffer::handle
  virtual void giveBack(void* handle) = 0;

  /// Copies the newest readings of the camera's clock into `fit`. Returns false, and leaves `fit` as it is, if there
  /// are none since the last call, or if the clock cannot be read. Does not wait.
  virtual bool takeClock(ClockFit& /*fit*/) { return false; }

  /// Returns the function that frees a buffer whose driver has been destroyed.
  using Discard = void (*)(void* handle);
  virtual Discard discard() const = 0;

  /// Returns the reason for kEnd; EX_OK: all pictures were delivered. Must only be called after kEnd.
  virtual Error end() const { return {.exitCode = EX_OK}; }

  /// Liveness check, called if no picture comes. Returns why the camera is lost, as the end of a sentence; empty if it
  /// is alive or cannot be asked. Takes up to 0.2 s.
  virtual std::string doubt() { return ""; }

  /// Returns in what the last picture that was whole and of another shape differed, as the end of a sentence about the
  /// camera; empty if it is not known. Called when the driver is not lent.
  virtual std::string objection() const { return {}; }

  /// Notes that the camera does not answer: the destructor then does not ask it to stop, and link() reads no further
  /// register. Any thread.
  virtual void markSilent() {}

  /// Restores what opening has set, except what commands have done. Only the destructor may follow. May block.
  virtual void undo() {}

  /// Returns the state of the link. Counts of packets are added to `before`, the state at the end of the last session.
  /// May block.
  virtual CameraLink link(const CameraLink& /*before*/) { return {}; }

  /// Carries out an operator's request while the camera streams, as its message states. The error is a sentence:
  /// the camera refuses or does not answer. May block.
  virtual tl::expected<CameraReport, std::string> serve(const CameraStep& /*step*/) {
    return tl::unexpected<std::string>("this source of pictures has no features");
  }
};

/// Level of a line for the log.
enum class LogLevel { kInfo, kWarning };
/// Writes a line about a camera to the log. Called on the thread that opens or watches the camera.
using Say = std::function<void(LogLevel, const std::string& line)>;

/// Parameters of opening a driver.
struct Opening {
  const CameraInfo* before = nullptr;  ///< session whose camera and picture are wanted again; nullptr: the first one
  int attempt = 0;                     ///< number of tries since that session, from 0
  std::stop_token stop = {};           ///< ends the wait for the camera
  Say say = {};                        ///< may be empty
  std::function<void()> found = {};    ///< called when a camera is there, before it is set up; may be empty
};

/// Opens a driver; blocks. Opening::stop ends its waits for the camera. Exit codes of its errors: EX_UNAVAILABLE (the
/// camera is absent or does not answer: another try may succeed), EX_TEMPFAIL (another client holds it), all others
/// (another try would fail as well). Before the first session any ends the source, EX_UNAVAILABLE only without
/// CameraRules::wait; later the keeper tries again after each.
using OpenDriver = std::function<tl::expected<std::unique_ptr<Driver>, Error>(const Opening&)>;

}  // namespace tractiond::capture
