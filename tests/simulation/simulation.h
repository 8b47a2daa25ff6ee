// The instrument from the popped buffer to the published field, with zeros, calibration and the state directory, in a
// world of its own time. The laws are checked at every step.
#pragma once

#include "tests/simulation/story.h"

#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace tractiond::simulation {

struct Broken {
  std::string law;
  std::string what;
  std::int64_t at_ms = 0;
};

struct Result {
  std::optional<Broken> broken;
  std::string log;  ///< a line for each thing that happened
  std::uint64_t received = 0, published = 0, valid = 0;
  std::uint64_t zerosAsked = 0, zerosTaken = 0, undone = 0, restarts = 0;
  std::uint64_t fields = 0;  ///< hash of all bytes of all fields
  std::int64_t reached_ms = 0;
};

/// Makes the gel's mechanics once. Only one simulation runs at a time in a process.
class Simulation {
 public:
  Simulation();
  ~Simulation();

  /// \param goesOn asked once for each simulated second; false ends the run
  Result run(const Story& story, const std::function<bool()>& goesOn = {});

  /// Returns the story with as few happenings as still break the same law.
  Story shrink(const Story& story, const std::string& law);

 private:
  struct Gel;
  struct Run;
  std::unique_ptr<Gel> gel_;
};

}  // namespace tractiond::simulation
