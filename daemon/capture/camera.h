// A camera as a source of frames, for any driver: rejects buffers that are not new and whole, tells when a picture was
// taken, and survives the loss of the camera.
//
// Pictures keep the shape of the first session. Those of earlier sessions stay known: one that comes again is stale.
//
// A session lasts from an opening of the camera to its loss or closing. The thread "camera-keeper" (keeper.h) opens the
// driver, watches it while it streams, and closes it; next() only pops, admits and hands on.
#pragma once

#include "daemon/capture/device_clock.h"
#include "daemon/capture/frame_gate.h"
#include "daemon/capture/frame_source.h"
#include "daemon/capture/keeper.h"
#include "daemon/records/ledger.h"

#include <tl/expected.hpp>

#include <memory>
#include <optional>
#include <thread>
#include <utility>

namespace tractiond::capture {

/// Thread-bound to the capture thread, except for the functions that state something else.
class Camera : public FrameSource {
 public:
  /// Opens a camera and returns when the first try has ended: with the camera, or while it is still awaited
  /// (CameraRules::wait). Blocks as long as that try, seconds if the camera hangs. Fails with the error of the first
  /// try: see OpenDriver, or that of `check`. The ledger must outlive the camera. `say` and `check` are called on
  /// the keeper's thread, also after open(), but not after the camera has been destroyed; both may be empty.
  static tl::expected<std::unique_ptr<Camera>, Error> open(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                                           Say say = {}, CheckCamera check = {});
  /// Creates a camera without the keeper's thread, for a caller that calls keeperTurn() itself. Does not open it yet.
  static std::unique_ptr<Camera> withoutThread(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                               Say say = {}, CheckCamera check = {});
  /// Takes one turn of the keeper, for a camera of withoutThread(). Returns when the next turn is due, by
  /// CameraRules::clock [ns]; Keeper::kNever: the keeper has ended. See Keeper::turn().
  std::int64_t keeperTurn() { return keeper_->turn(); }
  /// Takes at most half a second, whatever the camera does, and as long as a `say` or `check` that is being called.
  /// Every frame must have been recycled.
  ~Camera() override;

  /// Waits at most `timeout` for a frame, once more for the first one of a session. Returns kRejected for a buffer that
  /// is not a new and whole picture; it has been given back. Returns kEnd, now and from now on, when the source has
  /// ended or the awaited camera cannot be used: see error(). Returns kTimeout after a quarter of a second or less if
  /// nothing has arrived, at once when a camera is lost, and while none streams after `timeout`.
  Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  /// Gives the memory of a frame back, also if its camera has been lost or reopened meanwhile. Has no effect on a Frame
  /// that was recycled before.
  void recycle(Frame& frame) override;

  /// Returns the reason for kEnd; exit code EX_OK if the source delivered all its pictures. Before kEnd it has no
  /// meaning.
  const Error& error() const { return error_; }

  /// Returns the description of the newest session, also of one that has been lost; sessions count from 1. nullptr if
  /// there was none. Thread-safe.
  std::shared_ptr<const CameraInfo> info() const { return keeper_->info(); }

  /// Returns whether the camera is searched for, set up, streaming or lost. Thread-safe.
  CameraState state() const { return keeper_->state(); }

  /// Returns whether no camera streams and the keeper hangs, in a call of the driver for longer than
  /// CameraRules::slowest: the watchdog is then not fed. Thread-safe, does not wait.
  bool isForsaken() const { return keeper_->isForsaken(); }

  /// Copies the newest state of the camera and of its link. Returns false, and leaves `vitals` as they are, if nothing
  /// was read since the last call. For one thread; does not wait.
  bool takeVitals(CameraVitals& vitals) { return keeper_->takeVitals(vitals); }

  /// Sets how the camera is opened from now on. A streaming camera is closed by the following next() and opened again
  /// at once. If the camera refuses the new settings, or its picture would differ, the keeper logs it and opens the
  /// camera as before. Returns at once; of several calls the last counts. Thread-safe.
  void reopen(OpenDriver driver) { keeper_->reopen(std::move(driver)); }

  /// Returns whether the camera refused the settings of the last reopen(); false as long as they have not been tried.
  /// Thread-safe.
  bool refusedLast() const { return keeper_->refusedLast(); }

  /// Sends a request to the camera; takeAnswer() returns the answer, once, as soon as it is there, and nothing before.
  /// The answer is an error, a sentence for the client, if the camera refuses, is lost meanwhile, or none streams. One
  /// request at a time. Both functions are for one thread and do not wait.
  void ask(const CameraStep& step) { keeper_->ask(step); }
  std::optional<tl::expected<CameraReport, std::string>> takeAnswer() { return keeper_->takeAnswer(); }

 private:
  Camera(const CameraRules& rules, Ledger& ledger, std::shared_ptr<Keeper> keeper);

  bool adopt(std::chrono::milliseconds timeout);
  Next admit(Frame& frame, const Buffer& buffer);
  std::int64_t patience() const;
  void giveUp(Loss why);
  void end(Error error);

  CameraRules rules_;
  Ledger& ledger_;
  std::optional<FrameGate> gate_;  ///< from the first session on
  CaptureClock clock_;
  ClockFit asked_;                  ///< room for a reading of the driver
  std::shared_ptr<Keeper> keeper_;  ///< shared with its thread
  std::thread keeperThread_;
  Driver* driver_ = nullptr;  ///< borrowed from the keeper; none while the keeper opens or closes the camera
  unsigned session_ = 0;
  Driver::Discard discard_ = nullptr;
  std::uint64_t content_ = 0;  ///< Arrival::content of the last whole picture
  std::int64_t lastArrival_ns_ = 0, lastWhole_ns_ = 0, lastDoubt_ns_ = 0;
  std::int64_t longest_ns_ = 0;  ///< longest recent time between two arrivals
  bool ended_ = false;
  Error error_;
};

}  // namespace tractiond::capture
