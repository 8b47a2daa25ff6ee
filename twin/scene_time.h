// Computes the scenario times of the twin's pictures.
#pragma once

#include <algorithm>
#include <optional>

namespace twin {

/// Scenario time. It follows the clock while pictures are sent: if they are late, as on a machine that is too slow to
/// draw them all, it skips ahead. It stands still while no client receives pictures. Thread-bound.
class SceneTime {
 public:
  /// Returns the scenario time of the next picture [s], 0 at first, and advances it by the frame period `period_s` [s].
  double next(double period_s) {
    const double now_s = next_s_;
    next_s_ += period_s;
    return now_s;
  }

  /// Reports that a picture was sent. If pictures are late by half a period or more in total, next() skips ahead by
  /// that. A gap of more than 1.1 s counts as time without a client and does not.
  /// \param time_s of a steady clock [s]
  void wasSent(double time_s, double period_s) {
    const double gap_s = sent_s_ ? time_s - *sent_s_ : period_s;
    sent_s_ = time_s;
    if (gap_s > kNobodyThere_s) return;
    behind_s_ = std::max(behind_s_ + gap_s - period_s, -period_s);
    if (behind_s_ < period_s / 2) return;
    next_s_ += behind_s_;
    behind_s_ = 0.0;
  }

 private:
  static constexpr double kNobodyThere_s = 1.1;  // a camera's longest period is 1 s
  double next_s_ = 0.0, behind_s_ = 0.0;
  std::optional<double> sent_s_;
};

}  // namespace twin
