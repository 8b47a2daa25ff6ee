// capture::Camera of a life, above the simulated driver, and its laws.
#pragma once

#include "daemon/capture/camera.h"
#include "tests/simulation/driver.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/ongoing.h"

#include <algorithm>
#include <memory>
#include <string>

namespace tractiond::simulation {

class CaptureSide {
 public:
  /// All references must outlive it.
  CaptureSide(Camera& camera, const capture::CameraOptions& options, Ledger& ledger, Journal& journal,
              const Starvation& starvation);

  capture::Next next(Frame& frame, std::chrono::milliseconds timeout);
  void recycle(Frame& frame) { camera_->recycle(frame); }
  /// Returns when the capture stage wakes.
  std::int64_t wakes_ns() const {
    return connection_.isPopped ? std::min(nextPop_ns_, connection_.camera.arrives_ns()) : nextPop_ns_;
  }

  /// Takes a turn of the camera's keeper, unless a call of the driver keeps it busy. Returns when it is due again.
  std::int64_t keeperTurn();
  std::int64_t keeperIsBusyUntil_ns() const { return keeperIsBusyUntil_ns_; }
  /// Returns whether a camera has been opened in this life.
  bool hasOpened() const { return camera_->info() != nullptr; }
  bool isForsaken() const { return camera_->isForsaken(); }
  /// Returns whether the keeper hangs although no camera streams, by the world's own account.
  bool isHanging() const;

  /// Has the camera opened anew, after a reload.
  void reopen(const capture::CameraOptions& options) { camera_->reopen(fromSimulation(connection_, options)); }
  bool hasRefused() const { return camera_->refusedLast(); }
  bool isStreaming() const { return camera_->state() == CameraState::kStreaming; }
  /// Returns when the camera was opened last.
  std::int64_t opened_ns() const { return opened_ns_; }
  /// Returns the options that the camera was opened with last.
  const capture::CameraOptions& opened() const { return connection_.options; }
  /// Passes a request on, as a person asks for it. Law: none is open.
  void ask(const CameraStep& step);
  /// Returns whether a request is open.
  bool isAsked() const { return asked_ns_ != kNever; }
  /// Takes the answer, if it has come. Law: a request is open.
  void takeAnswer();

  /// Laws: the camera's state is true, its loss is noticed in time, the log tells why, and a request is answered in
  /// time.
  void check();

 private:
  void checkState() const;
  void checkTold();
  void checkNoticed() const;

  Journal& journal_;
  const Starvation& starvation_;
  std::string told_;     ///< the log's lines since the camera streamed
  std::string refused_;  ///< why the camera could not be opened, as far as the keeper knows
  Connection connection_;
  std::unique_ptr<capture::Camera> camera_;
  std::int64_t opened_ns_ = 0, nextPop_ns_, came_ns_;
  std::int64_t keeperBegan_ns_ = 0, keeperIsBusyUntil_ns_ = 0;
  std::int64_t asked_ns_ = kNever;  ///< kNever: nothing is asked
};

}  // namespace tractiond::simulation
