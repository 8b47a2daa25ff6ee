// Requests for zeros, undo and calibration steps, as the control server passes them on; and the laws of their answers.
#pragma once

#include "daemon/control/step_runner.h"
#include "daemon/records/zero_request.h"
#include "tests/simulation/ongoing.h"
#include "tests/simulation/zeros.h"

#include <optional>

namespace tractiond::simulation {

class Askers {
 public:
  /// All references must outlive it.
  Askers(Zeros& zeros, const Starvation& starvation, Journal& journal);

  /// Notes a request for a zero, or an undo.
  /// \return whether it is to begin; a later one of the same kind shares the answer to the one that is open, and
  /// another is refused
  /// \param within_s time within which the answer must come, as the status states; 0: none
  bool noteZero(double within_s, const ZeroRequest& request);
  /// Notes a request for a calibration step.
  /// \param within_ns time within which the answer must come
  void noteStep(const CalibrationStep& step, std::int64_t within_ns);
  void noteZeroAnswer(const tl::expected<RestPose, std::string>& answer);
  void noteStepAnswer(const calibrate::Result& answer);
  /// Law: no client has waited too long for its answer. Throws Broken.
  void check() const;
  /// Ends all requests without an answer, as the daemon was killed.
  void die();

 private:
  Zeros& zeros_;
  const Starvation& starvation_;
  Journal& journal_;

  bool zeroAsked_ = false;
  ZeroRequest request_;
  std::optional<Id> askedWith_, expected_;  ///< in force, and before it, when it was asked
  std::int64_t zeroUntil_ns_ = kNever, zeroAskedStarved_ns_ = 0;
  bool stepAsked_ = false;
  std::int64_t stepUntil_ns_ = 0, stepAskedStarved_ns_ = 0;
};

}  // namespace tractiond::simulation
