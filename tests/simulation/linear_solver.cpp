#include "tests/simulation/linear_solver.h"

namespace tractiond::simulation {
namespace {

constexpr double kTouches = 2.0;  ///< something does if the squares exceed so many of noise

}  // namespace

LinearSolver::LinearSolver(const Gel& gel)
    : used_(gel.sensor.markerCount(), gel.options) {}

void LinearSolver::solve(const MarkerField& markers, TractionField& field) noexcept {
  field.markers = markers;
  field.flags = markers.flags;
  solve::clear(field);
  if ((markers.flags & kGelMismatch) != 0) return;
  if ((markers.flags & kFewMarkers) != 0 || !used_.choose(markers)) {
    field.flags |= kFewMarkers;
    return;
  }
  field.valid = true;
  field.solution = Solution::kFull;
  field.method = Method::kNoContact;
  const double noise_px2 = used_.noise_px() * used_.noise_px();
  if (used_.squares_px2() <= kTouches * noise_px2 * used_.count()) return;
  field.method = Method::kContact;
  field.resultant_N[2] = used_.squares_px2();
}

}  // namespace tractiond::simulation
