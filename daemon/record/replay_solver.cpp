#include "daemon/record/replay_solver.h"

#include "daemon/solve/field_rules.h"
#include "traction/v1/field.pb.h"

#include <algorithm>
#include <limits>

namespace tractiond {
namespace {

/// Frames that are kept: a model is in force for fewer, at up to a thousand frames a second.
constexpr std::size_t kKept = 64;

}  // namespace

void ReplaySolver::note(std::string_view bytes) {
  traction::v1::Field message;
  if (bytes.size() > std::numeric_limits<int>::max() ||
      !message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return;
  }
  how_[message.header().frame_number()] = {
      .solution = message.solution() == traction::v1::SOLUTION_LINEAR ? Solution::kLinear : Solution::kFull,
      .modelFrame = message.model_frame(),
      .isNotSolved = (message.header().flags() & kNotSolved) != 0};
}

void ReplaySolver::solve(const std::shared_ptr<solve::FieldSolver>& solver, const MarkerField& markers,
                         TractionField& field) {
  const auto found = how_.find(markers.info.frameNumber);
  const How how = found == how_.end() ? How{} : found->second;
  if (how.solution == Solution::kLinear && !how.isNotSolved) {
    if (!learn(solver, how.modelFrame, field) || !solver->answer(markers, field)) {
      ++others_;
      solver->solve(markers, field);
    }
  } else {
    solver->solve(markers, field);
  }
  if (how.isNotSolved) {
    solve::clear(field);
    field.flags = markers.flags | kNotSolved;
  }
  passed_.push_back({solver, markers});
  if (passed_.size() > kKept) passed_.pop_front();
}

/// Makes the model of a frame, unless it is the newest one. False: the frame is not there, or its solver was another.
bool ReplaySolver::learn(const std::shared_ptr<solve::FieldSolver>& solver, std::uint64_t frame, TractionField& field) {
  if (frame == learnt_) return true;
  const auto isIt = [&](const Passed& each) { return each.markers.info.frameNumber == frame && each.solver == solver; };
  const auto it = std::ranges::find_if(passed_, isIt);
  if (it == passed_.end()) return false;
  solver->solve(it->markers, field);
  if (!solver->learn()) return false;
  learnt_ = frame;
  return true;
}

}  // namespace tractiond
