// Whether the markers are found and are those of the gel file; what the picture shows where they are not; why there is
// no first zero.
#pragma once

#include "base/clock.h"
#include "base/mailbox.h"
#include "daemon/records/gel_report.h"
#include "daemon/snapshots.h"
#include "daemon/track/tracker.h"
#include "traction/v1/status.pb.h"

#include <functional>
#include <string>

namespace tractiond {

struct GelWatchOptions {
  double patience_s = 1.0;                 ///< for which markers must be missing before the picture is looked at
  double between_s = 5.0;                  ///< two looks
  double betweenLines_s = 30.0;            ///< two lines in the log of the same kind
  double longestWait_s = 3.0;              ///< for a frame, when a snapshot is asked for
  std::int64_t (*clock)() = monotonicNow;  ///< [ns]
};

/// Bound to the control thread, but for takeFrame().
class GelWatch {
 public:
  /// Sensor, tracker and status outlive this. `answer`: what came of askSnapshot(), within a turn().
  GelWatch(const sensor::Sensor& sensor, track::Tracker& tracker, Mailbox<traction::v1::MarkerStatus>& status,
           std::function<void(const Snapshots::Result&)> answer, const GelWatchOptions& options = {});

  /// Compares the gel file with a zero. Pictures that come later are not compared: a load hides markers, too.
  GelReport judge(const RestPose& zero);

  /// Tells the tracker and the status what judge() has returned for a zero that comes into force.
  void tellJudgement(const RestPose& zero, GelReport report);

  /// Somebody wants to see the next picture.
  void askSnapshot() { snapshots_.ask(); }

  /// Does what is due.
  void turn();

  /// Returns whether a zero is being taken: the thread that judges it should not sleep.
  bool hurried() const {
    const track::ZeroState state = tracker_.zeroState();
    return state == track::ZeroState::kTaking || state == track::ZeroState::kTakingFirst;
  }

  /// On the tracking thread, after the frame was tracked: copies it if a picture is wanted. Allocates nothing.
  void takeFrame(const Frame& frame);

 private:
  void watchMissing(std::int64_t now_ns);
  void watchFirstZero(std::int64_t now_ns);
  void look(const Snapshot& snapshot);
  void tell();

  const sensor::Sensor& sensor_;
  track::Tracker& tracker_;
  Mailbox<traction::v1::MarkerStatus>& status_;
  GelWatchOptions options_;

  MarkerSight sight_;
  bool judging_ = false;  ///< there is a zero
  GelReport report_;      ///< on the zero in force

  std::int64_t foundAt_ns_ = 0;   ///< when the markers were found last, or the watch began
  std::int64_t lookedAt_ns_ = 0;  ///< when the picture was looked at last
  std::int64_t loggedAt_ns_ = 0;
  std::string missing_;  ///< what was seen then
  std::string noZero_;   ///< why there is no first zero; empty: there is one, or it has not been waited for long
  std::int64_t noZeroLoggedAt_ns_ = 0;

  Snapshots snapshots_;
  bool lookWanted_ = false;
};

}  // namespace tractiond
