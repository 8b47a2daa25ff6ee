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
    const double counts = std::round(gain * beyond(wrench[i], 0.0, deadZone));
    axes[i] = static_cast<std::int32_t>(std::clamp<double>(counts, -kMostCounts, kMostCounts));
  }
  return axes;
}

double beyond(double value, double deviation, double deadZone) {
  return std::copysign(std::max(std::abs(value) - std::max(deadZone, 3.0 * deviation), 0.0), value);
}

int Zoom::step(const Touches& touches) {
  const bool isTouched = touches.valid && !touches.touches.empty();
  const std::int64_t before_ns = std::exchange(time_ns_, isTouched ? touches.time_ns : 0);
  if (!isTouched || before_ns == 0) return rest_ = 0.0, 0;
  const double dt = stepOf(before_ns, touches.time_ns);
  const Gradient& gradient = touches.gradient;
  rest_ += options_.gain * dt * beyond(gradient.dilation_Pa_m, gradient.deviation_Pa_m, options_.deadZone_Pa_m);
  const double notches = std::trunc(rest_);
  rest_ -= notches;
  return static_cast<int>(notches);
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
