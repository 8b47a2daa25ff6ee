#include "touch/critical_point_tracker.h"

#include "touch/assignment.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>

namespace touch {
namespace {

constexpr double kPointBegins = 1.0;  ///< cost of a point that begins: that of the farthest step
constexpr double kNoStep = 1000.0;    ///< cost of what is impossible

double cost(const CriticalPoint& from, const CriticalPoint& to) {
  const Eigen::Vector2d step(to.position_m[0] - from.position_m[0], to.position_m[1] - from.position_m[1]);
  const double squared = step.squaredNorm() / (CriticalPointTracker::kReach_m * CriticalPointTracker::kReach_m);
  return from.index == to.index && squared < kPointBegins ? squared : kNoStep;
}

}  // namespace

const std::vector<CriticalPoint>&
CriticalPointTracker::update(const Field& field, const std::vector<CriticalPoint>& points, double memory_s) {
  seen_.clear();
  const bool advances = field.valid ? field.time_ns > last_ns_ : field.time_ns >= last_ns_;
  if (!advances || (field.valid && field.basis != basis_)) tracks_.clear();
  std::erase_if(tracks_, [&](const Track& track) { return seconds(track.seen_ns, field.time_ns) > memory_s; });
  if (!field.valid) return seen_;
  basis_ = field.basis;
  last_ns_ = field.time_ns;
  const auto known = static_cast<Eigen::Index>(tracks_.size());
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd costs = Eigen::MatrixXd::Constant(count, known + count, kPointBegins);
  for (Eigen::Index row = 0; row < count; ++row) {
    for (Eigen::Index column = 0; column < known; ++column) {
      costs(row, column) = cost(tracks_[static_cast<std::size_t>(column)].point, points[static_cast<std::size_t>(row)]);
    }
  }
  const std::vector<int> pairs = assign(costs);
  for (std::size_t row = 0; row < points.size(); ++row) {
    const auto column = static_cast<std::size_t>(pairs[row]);
    const bool isKnown = pairs[row] < known;
    Track& track = isKnown ? tracks_[column] : tracks_.emplace_back();
    CriticalPoint point = points[row];
    point.id = isKnown ? track.point.id : ++lastId_;
    point.begun_ns = isKnown ? track.point.begun_ns : field.time_ns;
    track = {point, field.time_ns};
    seen_.push_back(point);
  }
  std::ranges::sort(seen_, {}, &CriticalPoint::id);
  return seen_;
}

}  // namespace touch
