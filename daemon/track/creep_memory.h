// Takes off what earlier loads still displace: a gel that was loaded recovers with a delay (docs/mathematics.md, 2.6).
//
//   d = u + sum s_k h_k,  dh_k/dt = (u - h_k) / t_k     u: what the forces of this moment displace
//
// Between frames u is taken to be linear, for any interval; u and h_k follow from displacements alone. Motion of the
// whole picture passes as if forces had caused it: what is taken off is again such a motion, which the solver finds.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <optional>
#include <vector>

namespace tractiond::track {

/// How h of a term of this time follows over a step in which u is linear: of itself, of u before and of u now.
struct CreepStep {
  CreepStep(double seconds, double time_s);
  double left, before, now;
};

/// Returns when a frame was captured; where that is not known, when it was received.
inline std::int64_t momentOf(const FrameTimes& times) {
  return times.captured_ns != 0 ? times.captured_ns : times.received_ns;
}

/// Thread-bound. Allocates only when made, and at its first frame.
class CreepMemory {
 public:
  /// \param terms of the gel's creep; without any it does nothing
  /// \param markers M
  CreepMemory(const std::vector<sensor::CreepTerm>& terms, int markers);
  CreepMemory(const CreepMemory&) = delete;
  CreepMemory& operator=(const CreepMemory&) = delete;

  /// Advances to a frame, and sets `elastic_px`, `creepErrors_px` and `creepError_px` of its markers. A marker that is
  /// not valid counts as staying where it was. Where time does not advance, nothing but this frame's displacement is
  /// taken over; another zero begins with a gel at rest.
  void advance(MarkerField& markers);

  /// Says that the next frame's zero is of an earlier run: what the gel remembers of that is not known. Frames have
  /// kRecovering until three times its longest time have passed.
  void doubt() { isDoubted_ = true; }

  /// Continues from what is known otherwise, instead of a gel at rest.
  /// \param elastic_px u, 2 M
  /// \param follows_px h of each term, 2 M x terms
  void resume(const Id& zero, std::int64_t time_ns, const Eigen::VectorXd& elastic_px,
              const Eigen::MatrixXd& follows_px);

 private:
  const Eigen::VectorXd shares_, times_s_;
  const Eigen::MatrixXd root_;      ///< of the covariance of the shares
  Eigen::VectorXd elastic_, next_;  ///< u, 2 M
  Eigen::MatrixXd follows_;         ///< h of each term, 2 M x terms
  Eigen::VectorXf followed_;        ///< one column of these
  std::int64_t time_ns_ = 0;
  bool isDoubted_ = false;
  std::int64_t doubtedUntil_ns_ = 0;
  std::optional<Id> zero_;  ///< of the last frame
};

}  // namespace tractiond::track
