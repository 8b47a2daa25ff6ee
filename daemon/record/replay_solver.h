// Solves the frames of a recording as the daemon did then: each by the model that the recording states, made anew from
// the frame that it was of.
#pragma once

#include "daemon/records/traction_field.h"
#include "daemon/solve/field_solver.h"

#include <cstdint>
#include <deque>
#include <memory>
#include <string_view>
#include <unordered_map>

namespace tractiond {

/// Thread-bound.
class ReplaySolver {
 public:
  /// Notes how a recorded field was solved. What cannot be read is left out.
  /// \param bytes of the message
  void note(std::string_view bytes);

  /// Solves a frame of the recording; those of which nothing was noted by a model of their own. Frames must come in
  /// their order, those that are not to be solved left out.
  void solve(const std::shared_ptr<solve::FieldSolver>& solver, const MarkerField& markers, TractionField& field);

  /// Returns how many frames the recording solved by a model, but this object in full: the model's frame is missing, or
  /// lies too far back, or the model could not be made or did not answer. Does not count those of which nothing was
  /// noted.
  std::uint64_t others() const { return others_; }

 private:
  struct How {
    Solution solution = Solution::kNone;
    std::uint64_t modelFrame = 0;
    bool isNotSolved = false;
  };
  struct Passed {
    std::shared_ptr<solve::FieldSolver> solver;
    MarkerField markers;
  };

  bool learn(const std::shared_ptr<solve::FieldSolver>& solver, std::uint64_t frame, TractionField& field);

  std::unordered_map<std::uint64_t, How> how_;  // by the number of the frame
  std::deque<Passed> passed_;                   // the newest frames
  std::uint64_t learnt_ = 0;                    // frame of the newest model
  std::uint64_t others_ = 0;
};

}  // namespace tractiond
