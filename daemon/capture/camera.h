// A camera as a source of frames, for any driver: rejects buffers that are not new and whole, tells when a picture was
// taken, and survives the loss of the camera.
//
// The thread "camera-keeper" (keeper.h) opens the driver, watches it while it streams, and closes it; next() only pops,
// judges and hands on.
#pragma once

#include "daemon/capture/frame_source.h"
#include "daemon/capture/intake.h"
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
  /// try: see OpenDriver, or that of `welcome`. The ledger must outlive the camera. `say` and `welcome` are called on
  /// the keeper's thread, also after open(), but not after the camera has been destroyed; both may be empty.
  static tl::expected<std::unique_ptr<Camera>, Error> open(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                                           Say say = {}, Welcome welcome = {});
  /// Creates a camera without the keeper's thread, for a caller that calls keeperTurn() itself. Does not open it yet.
  static std::unique_ptr<Camera> withoutThread(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                               Say say = {}, Welcome welcome = {});
  /// Takes one turn of the keeper, for a camera of withoutThread(). Returns when the next turn is due, by
  /// CameraRules::clock [ns]; Keeper::kNever: the keeper has ended. See Keeper::turn().
  std::int64_t keeperTurn() { return keeper_->turn(); }
  /// Takes at most half a second, whatever the camera does. Every frame must have been recycled.
  ~Camera() override;

  /// Waits at most `timeout` for a frame. Returns kEnd when the source has ended or the awaited camera cannot be used:
  /// see error(). Returns kTimeout at once when a camera is lost, and while none streams after `timeout`.
  Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  /// Gives the memory of a frame back, also if its camera has been lost or reopened meanwhile.
  void recycle(Frame& frame) override;

  /// Returns the reason for kEnd; exit code EX_OK if the source delivered all its pictures.
  const Error& error() const { return error_; }

  /// Returns the description of the newest session, whose number counts from 1; nullptr if there was none. Thread-safe.
  std::shared_ptr<const CameraInfo> info() const { return keeper_->info(); }

  CameraState state() const { return keeper_->state(); }  ///< Thread-safe.

  /// Returns whether no camera streams and the keeper hangs. Thread-safe, does not wait.
  bool isForsaken() const { return keeper_->isForsaken(); }

  /// Takes the newest vitals. Returns false if they have not changed since the last call. For one thread; does not
  /// wait.
  bool takeVitals(CameraVitals& vitals) { return keeper_->takeVitals(vitals); }

  /// Sets how the camera is opened from now on. A streaming camera is closed and opened again at once. If the camera
  /// refuses the new settings, the keeper logs it and opens the camera as before. Thread-safe.
  void reopen(OpenDriver driver) { keeper_->reopen(std::move(driver)); }

  /// Returns whether the camera refused the settings of the last reopen(). Thread-safe.
  bool refusedLast() const { return keeper_->refusedLast(); }

  /// Sends a request to the camera; takeAnswer() returns the answer once it is there, also if the camera is lost
  /// meanwhile, and nothing before. Its error is a sentence for the client. One request at a time. Both functions are
  /// for one thread and do not wait.
  void ask(const CameraStep& step) { keeper_->ask(step); }
  std::optional<tl::expected<CameraReport, std::string>> takeAnswer() { return keeper_->takeAnswer(); }

 private:
  Camera(const CameraRules& rules, Ledger& ledger, std::shared_ptr<Keeper> keeper);

  bool adopt(std::chrono::milliseconds timeout);
  Next judge(Frame& frame, const Buffer& buffer);
  std::int64_t patience() const;
  void giveUp(Loss why);
  void end(Error error);

  CameraRules rules_;
  Ledger& ledger_;
  Intake intake_;
  std::shared_ptr<Keeper> keeper_;  ///< shared with its thread
  std::thread keeperThread_;
  Driver* driver_ = nullptr;  ///< borrowed from the keeper; none while the keeper opens or closes the camera
  unsigned session_ = 0;
  Driver::Discard discard_ = nullptr;
  std::int64_t lastArrival_ns_ = 0, lastWhole_ns_ = 0, lastDoubt_ns_ = 0;
  std::int64_t longest_ns_ = 0;  ///< longest recent time between two arrivals
  bool ended_ = false;
  Error error_;
};

}  // namespace tractiond::capture
