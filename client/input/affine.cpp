#include "client/input/affine.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

namespace traction::input {
namespace {

using Place = std::complex<double>;

Place placeOf(const Touch& touch) {
  return {touch.position_m[0], touch.position_m[1]};
}

}  // namespace

std::array<std::int32_t, 6> axesOf(const Wrench& wrench, const AxesOptions& options) {
  std::array<std::int32_t, 6> axes{};
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const double deadZone = i < 3 ? options.deadZone_N : options.deadZone_Nm;
    const double gain = i < 3 ? options.gain_N : options.gain_Nm;
    const double beyond = std::max(std::abs(wrench[i]) - deadZone, 0.0);
    const double counts = std::min(std::round(gain * beyond), static_cast<double>(kMostCounts));
    axes[i] = static_cast<std::int32_t>(std::copysign(counts, wrench[i]));
  }
  return axes;
}

const Similarity& Gesture::follow(const Touches& touches) {
  // A field without one of them tells nothing of how they moved together; the next one does.
  if (!std::all_of(touches.touches.begin(), touches.touches.end(), [](const Touch& one) { return one.seen; }))
    return sum_;
  if (touches.touches.size() < 2) {
    isUnderWay_ = false;
  } else if (!std::exchange(isUnderWay_, true)) {
    sum_ = {};
  }
  const std::vector<Touch> earlier = std::exchange(before_, touches.touches);
  std::vector<std::pair<Place, Place>> pairs;  // before and now
  for (const Touch& touch : touches.touches) {
    const auto same =
        std::find_if(earlier.begin(), earlier.end(), [&](const Touch& one) { return one.id == touch.id; });
    if (same != earlier.end()) pairs.emplace_back(placeOf(*same), placeOf(touch));
  }
  if (pairs.size() < 2) return sum_;

  Place centre = 0.0, centreNow = 0.0;
  for (const auto& [before, now] : pairs) {
    centre += before / static_cast<double>(pairs.size());
    centreNow += now / static_cast<double>(pairs.size());
  }
  // Least squares: now - centreNow = factor (before - centre).
  Place product = 0.0;
  double square = 0.0;
  for (const auto& [before, now] : pairs) {
    product += (now - centreNow) * std::conj(before - centre);
    square += std::norm(before - centre);
  }
  sum_.shift_m[0] += (centreNow - centre).real();
  sum_.shift_m[1] += (centreNow - centre).imag();
  if (square > 0.0 && std::norm(product) > 0.0) {
    sum_.turn_rad += std::arg(product);
    sum_.scale *= std::abs(product) / square;
  }
  return sum_;
}

}  // namespace traction::input
