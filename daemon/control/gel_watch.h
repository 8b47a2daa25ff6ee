// Checks whether the markers are found and are those of the gel file, and explains in log and status what the picture
// shows if not, and why there is no first zero.
#pragma once

#include "base/mailbox.h"
#include "daemon/control/procedure_parts.h"
#include "daemon/control/snapshots.h"
#include "daemon/track/tracker.h"
#include "traction/v1/status.pb.h"

#include <cstddef>
#include <string>
#include <utility>

namespace tractiond::control {

/// Markers are missing if they are not followed, or if fewer than half of a layer's are found.
/// Bound to the control thread, except for takeFrame().
class GelWatch final : public GelComparison {
 public:
  /// Sensor, tracker and status must outlive this.
  /// \param status receives what is to be published; where the other thread is taking it, the next turn() puts it there
  /// \param replies gets the answer to askSnapshot() within turn(); outlives this; nullptr: that is not called
  GelWatch(const sensor::Sensor& sensor, track::Tracker& tracker, Mailbox<traction::v1::MarkerStatus>& status,
           Replies* replies);

  // These implement GelComparison.
  GelReport compare(const RestPose& zero) override;
  void report(const RestPose& zero, const GelReport& report) override;

  /// Requests a snapshot of the next picture. A later turn() answers: with the snapshot, which is valid during the
  /// answer, or with a sentence if no frame came within 3 s. One request at a time.
  void askSnapshot() { snapshots_.ask(); }
  /// Takes over the camera of a new session: Snapshots::setCamera().
  void setCamera(std::size_t frame_bytes, std::string waits) { snapshots_.setCamera(frame_bytes, std::move(waits)); }

  /// Does what is due: answers snapshots, updates the status, and logs why markers or a first zero are missing. Must be
  /// called in each turn of the control loop. Does not wait, but an examination of a picture takes up to a second.
  void turn();

  /// Returns whether frames are being averaged for a zero: the control thread should then take short turns.
  bool hurried() const {
    const track::ZeroState state = tracker_.zeroState();
    return state == track::ZeroState::kTaking || state == track::ZeroState::kTakingFirst;
  }

  /// Copies the frame and the places of its markers if a picture is wanted; a frame that is larger than the memory is
  /// left out, and a later one copied. For the tracking thread, after the frame was tracked. Allocates nothing.
  void takeFrame(const Frame& frame);

 private:
  void watchMissing(std::int64_t now_ns);
  void watchFirstZero(std::int64_t now_ns);
  void examine(const Snapshot& snapshot);
  void tell();

  const sensor::Sensor& sensor_;
  track::Tracker& tracker_;
  Mailbox<traction::v1::MarkerStatus>& status_;

  MarkerSight sight_;
  bool hasZero_ = false;  ///< there is a zero
  GelReport report_;      ///< on the zero in force
  bool toTell_ = false;   ///< the other thread was taking the status

  std::int64_t foundAt_ns_ = 0;     ///< when the markers were found last, or the watch began
  std::int64_t examinedAt_ns_ = 0;  ///< time of the last examination
  std::int64_t loggedAt_ns_ = 0;
  std::string missing_;  ///< result of the last examination
  std::string noZero_;   ///< why there is no first zero; empty: there is one, or it has not been waited for long
  std::int64_t noZeroLoggedAt_ns_ = 0;

  Snapshots snapshots_;
  bool examinationDue_ = false;
};

}  // namespace tractiond::control
