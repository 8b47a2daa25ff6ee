// The other half of a source of pictures: is this buffer new and whole, when was it taken, and what if the camera goes
// away. The same for every driver.
//
// One thread of ours, "camera-keeper", opens the driver, the first time and every later time, looks after it while it
// streams, and closes it; next() only pops, judges and hands on.
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

/// As a FrameSource bound to the capture thread; the functions marked so are thread-safe.
class Camera : public FrameSource {
 public:
  /// Returns when the first try has ended: with the camera, or without one that may be waited for, or its error. The
  /// ledger outlives the camera; `say` and `welcome` are not called after it has been destroyed.
  static tl::expected<std::unique_ptr<Camera>, Error> open(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                                           Say say = {}, Welcome welcome = {});
  /// The same without a thread, for those who call keeperTurn() themselves.
  static std::unique_ptr<Camera> withoutThread(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                               Say say = {}, Welcome welcome = {});
  /// As Keeper::turn().
  std::int64_t keeperTurn() { return keeper_->turn(); }
  /// Takes half a second at most, whatever the camera does. Every frame must have been recycled.
  ~Camera() override;

  /// kEnd when the source has ended, or the awaited camera cannot be used: see error().
  Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override;

  /// After kEnd. EX_OK: the pictures were all there were.
  const Error& error() const { return error_; }

  /// The newest session's, with its number from 1 on; nullptr: none yet. Thread-safe.
  std::shared_ptr<const CameraInfo> info() const { return keeper_->info(); }

  CameraState state() const { return keeper_->state(); }  ///< Thread-safe.

  /// No camera streams, and the thread that is to find one hangs. Thread-safe, waits for nobody.
  bool isForsaken() const { return keeper_->isForsaken(); }

  /// The newest, if it has changed since it was taken last. For one thread; waits for nobody.
  bool takeVitals(CameraVitals& vitals) { return keeper_->takeVitals(vitals); }

  /// From now on the camera is opened so: one that streams is given back, and opened anew at once. Where the camera
  /// refuses, that is told, and it is opened as before. Any thread.
  void reopen(OpenDriver driver) { keeper_->reopen(std::move(driver)); }

  /// It was opened as before, for it refused what reopen() asked last. Any thread.
  bool refusedLast() const { return keeper_->refusedLast(); }

  /// Asks the camera; the answer can be taken some time later, also where the camera is gone. One question at a time.
  /// Both for one thread.
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
  Driver* driver_ = nullptr;  ///< the keeper's, borrowed; none while it is at work
  unsigned session_ = 0;
  Driver::Discard discard_ = nullptr;
  std::int64_t lastArrival_ns_ = 0, lastWhole_ns_ = 0, lastDoubt_ns_ = 0;
  std::int64_t longest_ns_ = 0;  ///< between two arrivals lately
  bool ended_ = false;
  Error error_;
};

}  // namespace tractiond::capture
