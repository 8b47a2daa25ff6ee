// Takes off what earlier loads still displace: a gel that was loaded recovers with a delay (docs/mathematics.md, 2.6).
//
//   d = u + sum s_k h_k,  dh_k/dt = (u - h_k) / t_k     u: what the forces of this moment displace
//
// Between frames u is taken to be linear, for any interval; u and h_k follow from displacements alone. Motion of the
// whole picture passes as if forces had caused it: what is taken off is again such a motion, which the solver finds.
#pragma once

#include "daemon/records/marker_field.h"
#include "sensor/sensor.h"

#include <vector>

namespace tractiond::solve {

/// Thread-bound. Allocates only when made, and at its first frame.
class CreepMemory {
 public:
  /// \param terms of the gel's creep; without any it does nothing \param markers M
  CreepMemory(const std::vector<sensor::CreepTerm>& terms, int markers);
  CreepMemory(const CreepMemory&) = delete;
  CreepMemory& operator=(const CreepMemory&) = delete;

  /// Advances to a frame, and sets `elastic_px`, `creepErrors_px` and `creepError_px` of its markers. A marker that is
  /// not valid counts as staying where it was. Where time does not advance, nothing but this frame's displacement is
  /// taken over; another zero begins with a gel at rest.
  void advance(MarkerField& markers);

 private:
  struct Term {
    double share, time_s;
    double left = 1.0, before = 0.0, now = 0.0;  ///< shares in the new h: of h, of the u before and of the new one
    std::vector<double> follows;                 ///< h, 2 M
  };
  void step(double seconds);
  void takeOff(MarkerField& markers);
  void findErrors(MarkerField& markers) const;

  const std::size_t coordinates_;
  const Eigen::MatrixXd root_;   ///< of the covariance of the shares
  std::vector<double> elastic_;  ///< u
  std::vector<Term> terms_;
  std::int64_t time_ns_ = 0;
  Id zero_{};
  bool hasBegun_ = false;
};

}  // namespace tractiond::solve
