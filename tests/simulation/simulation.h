// The instrument from the popped buffer to the published field, with zeros, calibration and the state directory, in a
// world of its own time. The laws are checked at every step.
#pragma once

#include "tests/simulation/gel.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/story.h"

#include <memory>
#include <string>

namespace tractiond::simulation {

/// Makes the gel's mechanics once. Only one simulation runs at a time in a process.
class Simulation {
 public:
  Simulation();
  ~Simulation();

  /// Runs a story. A broken law is in Result::broken, and so is an exception that nobody caught.
  Result run(const Story& story);

 private:
  std::unique_ptr<const Gel> gel_;
};

}  // namespace tractiond::simulation
