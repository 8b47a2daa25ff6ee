// When the twin's pictures are.
#pragma once

#include <algorithm>
#include <optional>

namespace twin {

/// The scenario's time. It runs with the clock while pictures are sent: where they go out late, as on a machine that is
/// too slow to draw them all, what happens in the gel has gone on by the next ones. While nobody wants any it stands
/// still. Thread-bound.
class SceneTime {
 public:
  /// Of the next picture [s].
  double next(double period_s) {
    const double now_s = next_s_;
    next_s_ += period_s;
    return now_s;
  }

  /// At that time [s] of a steady clock.
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
  static constexpr double kNobodyThere_s = 1.1;  // the longest period of a camera is 1 s
  double next_s_ = 0.0, behind_s_ = 0.0;
  std::optional<double> sent_s_;
};

}  // namespace twin
