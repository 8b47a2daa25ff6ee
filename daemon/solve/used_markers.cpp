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
    , markers_(markers)
    , row_(static_cast<std::size_t>(padded(2 * markers)), 0.0)
    , rounded_(2 * markers_)
    , variance_(markers_) {
  missing_.reserve(2 * markers_);
}

bool UsedMarkers::choose(const MarkerField& markers) {
  double variance = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < markers_; ++i) {
    if (markers.valid[i] == 0) continue;
    variance += markers.variance_px2[i];
    ++count;
  }
  const double typical = count > 0 && variance > 0.0 ? variance / count : square(options_.noise_px);
  const double limit = kDoubtful * std::max(typical, square(options_.noise_px));
  variance = 0.0;
  count_ = 0;
  missing_.clear();
  squares_ = 0.0;
  std::fill(row_.begin(), row_.end(), 0.0);
  std::fill(rounded_.begin(), rounded_.end(), 0.0F);
  for (std::size_t i = 0; i < markers_; ++i) {
    const bool isUsed = markers.valid[i] != 0 && markers.variance_px2[i] <= limit;
    variance_[i] = isUsed ? markers.variance_px2[i] : 0.0F;
    if (isUsed) variance += markers.variance_px2[i];
    for (const std::size_t coordinate : {2 * i, 2 * i + 1}) {
      if (!isUsed) {
        missing_.push_back(static_cast<int>(coordinate));
        continue;
      }
      const float displacement = markers.byForces_px()[coordinate];
      ++count_;
      row_[coordinate] = rounded_[coordinate] = displacement;
      squares_ += square(displacement);
    }
  }
  const int used = count_ / 2;
  if (used == 0 || used < options_.fewestMarkers(static_cast<int>(markers_), markers.isolatedGaps)) return false;
  const double mean = variance / used;
  noise_px_ = mean > 0.0 ? std::sqrt(mean) : options_.noise_px;
  return true;
}

}  // namespace tractiond::solve
