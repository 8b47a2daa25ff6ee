// People who ask for zeros, undo and calibration steps, with the control server's manners; and the laws of answers.
#pragma once

#include "daemon/calibrate/calibration.h"
#include "daemon/procedures.h"
#include "tests/simulation/ongoing.h"
#include "tests/simulation/zeros.h"

#include <optional>

namespace tractiond::simulation {

class Askers {
 public:
  /// All outlive it.
  Askers(Zeros& zeros, const Starvation& starvation, Journal& journal);

  /// `within_s`: as the status says, 0: it does not
  void askZero(Procedures& procedures, double within_s, bool undo, bool anyway);
  /// `within_ns`: that it takes at most; later where it waits for earlier work
  void askStep(Procedures& procedures, const CalibrationStep& step, std::int64_t within_ns);
  void heedZeroAnswer(const tl::expected<RestPose, std::string>& answer);
  void heedStepAnswer(const calibrate::Result& answer);
  /// Whether those who wait have waited too long.
  void check() const;
  /// The daemon is dead, and nobody waits.
  void die();

 private:
  Zeros& zeros_;
  const Starvation& starvation_;
  Journal& journal_;

  int zeroAskers_ = 0;
  bool anyway_ = false, isUndo_ = false;
  std::optional<Id> askedWith_, expected_;  ///< in force, and before it, when it was asked
  std::int64_t zeroUntil_ns_ = kNever, zeroAskedStarved_ns_ = 0;
  bool stepAsked_ = false;
  std::int64_t stepUntil_ns_ = 0, stepAskedStarved_ns_ = 0;
};

}  // namespace tractiond::simulation
