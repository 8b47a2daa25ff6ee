#include "tests/simulation/learning_solver.h"

#include "daemon/solve/model_frame.h"

#include <utility>

namespace tractiond::simulation {
namespace {

/// Returns whether a frame's picture is that of another one, but for their noise.
bool holds(const MarkerField& model, const MarkerField& markers) {
  constexpr double kMost = 2.0;  // of what noise makes of it
  double squares_px2 = 0.0, expected_px2 = 0.0;
  for (std::size_t i = 0; i < markers.displacement_px.size(); ++i) {
    if (model.valid[i / 2] == 0 || markers.valid[i / 2] == 0) continue;
    const double moved_px = markers.displacement_px[i] - model.displacement_px[i];
    squares_px2 += moved_px * moved_px;
    expected_px2 += model.variance_px2[i / 2] + markers.variance_px2[i / 2];
  }
  return squares_px2 <= kMost * expected_px2;
}

}  // namespace

LearningSolver::LearningSolver(const Gel& gel, std::function<void()> work)
    : linear_(gel)
    , work_(std::move(work)) {}

void LearningSolver::solve(const MarkerField& markers, TractionField& field) noexcept {
  work_();
  linear_.solve(markers, field);
  canLearn_ = field.method == Method::kContact;
  solved_ = markers;
}

bool LearningSolver::learn() {
  if (!canLearn_) return false;
  work_();
  return newest_.put(solved_);
}

bool LearningSolver::answer(const MarkerField& markers, TractionField& field) noexcept {
  constexpr std::uint64_t kFresh = 3;
  wantsModel_ = true;
  linear_.solve(markers, field);
  if (field.method != Method::kContact) return true;
  newest_.swap(model_);
  field.solution = Solution::kLinear;
  field.modelFrame = model_.info.frameNumber;
  const bool isThere = !model_.valid.empty();
  if (!isThere || !solve::ModelFrame{model_.info, model_.zero}.isInForce(markers) || !holds(model_, markers)) {
    field.flags |= kUnexplained;
    return false;
  }
  wantsModel_ = markers.info.frameNumber - field.modelFrame >= kFresh;
  return true;
}

}  // namespace tractiond::simulation
