#include "daemon/app/invalid_fields.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond {

void InvalidFields::add(const TractionField& field) {
  isNew_ = true;
  flags_ = field.flags;
  found_ = field.markers.validCount;
  markers_ = static_cast<int>(field.markers.valid.size());
  isolatedGaps_ = field.markers.isolatedGaps;
}

std::string InvalidFields::take() {
  if (!std::exchange(isNew_, false)) return "";
  if ((flags_ & kGelMismatch) != 0) return "the gel file does not fit the picture (sensor.gel_file)";
  if ((flags_ & kNotSolved) != 0) return "their frames were not solved in time (solve.patience_ms)";
  if ((flags_ & kFewMarkers) == 0) return "their numbers are not finite";
  const int forTracking = static_cast<int>(std::ceil(minValidFraction_ * markers_));
  const int forSolving = solve_.fewestMarkers(markers_, isolatedGaps_);
  const std::string needed =
      forTracking > forSolving
          ? fmt::format("{} are needed (track.min_valid_fraction = {})", forTracking, minValidFraction_)
          : fmt::format("{} are needed (solve.max_missing_fraction = {})", forSolving, solve_.maxMissingFraction);
  const bool isEnough = found_ >= std::max(forTracking, forSolving);
  return fmt::format("{} of {} markers are found{}; {}", found_, markers_,
                     isEnough ? ", and some of them are too uncertain to count" : "", needed);
}

}  // namespace tractiond
