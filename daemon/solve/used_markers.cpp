#include "daemon/solve/used_markers.h"

#include <algorithm>
#include <cmath>

namespace tractiond::solve {
namespace {

/// A marker whose variance is so many times that of the others is taken out.
constexpr double kDoubtful = 16.0;

}  // namespace

UsedMarkers::UsedMarkers(int markers, const SolveOptions& options)
    : options_(options)
    , used_(static_cast<std::size_t>(markers))
    , row_(static_cast<std::size_t>(padded(2 * markers)), 0.0) {
  coordinates_.reserve(2 * used_.size());
  missing_.reserve(2 * used_.size());
  displacements_.reserve(2 * used_.size());
}

bool UsedMarkers::take(const MarkerField& markers) {
  double variance = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    if (markers.valid[i] == 0) continue;
    variance += markers.variance_px2[i];
    ++count;
  }
  const double typical = count > 0 && variance > 0.0 ? variance / count : square(options_.noise_px);
  const double limit = kDoubtful * std::max(typical, square(options_.noise_px));
  variance = 0.0;
  coordinates_.clear();
  missing_.clear();
  displacements_.clear();
  squares_ = 0.0;
  std::fill(row_.begin(), row_.end(), 0.0);
  for (std::size_t i = 0; i < used_.size(); ++i) {
    used_[i] = markers.valid[i] != 0 && markers.variance_px2[i] <= limit ? 1 : 0;
    if (used_[i] != 0) variance += markers.variance_px2[i];
    for (const std::size_t coordinate : {2 * i, 2 * i + 1}) {
      if (used_[i] == 0) {
        missing_.push_back(static_cast<int>(coordinate));
        continue;
      }
      const float displacement = markers.displacement_px[coordinate];
      coordinates_.push_back(static_cast<int>(coordinate));
      displacements_.push_back(displacement);
      row_[coordinate] = displacement;
      squares_ += square(displacement);
    }
  }
  const int used = static_cast<int>(coordinates_.size() / 2);
  if (used == 0 || used < options_.fewestMarkers(static_cast<int>(used_.size()), markers.isolatedGaps)) return false;
  const double mean = 2.0 * variance / static_cast<double>(coordinates_.size());
  noise_px_ = mean > 0.0 ? std::sqrt(mean) : options_.noise_px;
  return true;
}

}  // namespace tractiond::solve
