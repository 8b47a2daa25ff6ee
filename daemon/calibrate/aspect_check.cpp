#include "daemon/calibrate/aspect_check.h"

#include "daemon/calibrate/geometry_fit.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::calibrate {
namespace {

constexpr double kAlarm = 5.0;               // deviations
constexpr double kBetter = 0.5;              // times the residual of the best camera with the file's aspect
constexpr double kLargestResidual_px = 0.5;  // a larger one shows that the aspect is not the cause
constexpr double kLargestFocal = 0.5;        // relative; a larger one: from far away every slant looks like an aspect

/// Returns the sensor with deviations of the lens so large that a fit can explain the picture by it instead.
sensor::Sensor loosened(sensor::Sensor sensor) {
  sensor::Uncertainty& known = sensor.uncertainty;
  known.focal = std::max(known.focal, 0.2);
  known.principal_px = std::max(known.principal_px, 50.0);
  known.k1 = std::max(known.k1, 1.0);
  known.k2 = std::max(known.k2, 10.0);
  return sensor;
}

}  // namespace

std::string AspectSeen::what() const {
  const double share = aspect / expected - 1.0;
  return fmt::format("the picture's scale differs in x and y: along y it is {:.1f} % {} than camera.aspect = {:g} says",
                     100.0 * std::abs(share), share > 0.0 ? "larger" : "smaller", expected);
}

std::string AspectSeen::remedy() const {
  return fmt::format(
      "write aspect = {:.4f} into [camera] of the gel file if the pixels are not square or the picture was "
      "resized; otherwise measure the markers' pitch in x and in y",
      aspect);
}

std::optional<AspectSeen> seenAspect(const sensor::Sensor& start, double first, std::span<const float> place_px,
                                     std::span<const std::uint8_t> present, const AspectCheckOptions& options) {
  sensor::Sensor loose = loosened(start);
  AspectSeen seen;
  seen.expected = start.camera.aspect;
  loose.camera.aspect = first;
  const GeometryOptions heldAspect{.iterations = options.iterations};
  const GeometryOptions anyAspect{.aspect = std::numeric_limits<double>::infinity(), .iterations = options.iterations};
  const Geometry free = fitGeometry(loose, place_px, present, anyAspect);
  if (free.outcome != Geometry::Outcome::kConverged || free.residual_px > kLargestResidual_px) {
    return std::nullopt;
  }
  seen.aspect = free.camera.aspect;
  seen.residual_px = free.residual_px;
  seen.deviation = std::hypot(free.aspectDeviation, options.pattern * seen.aspect);
  if (std::abs(seen.aspect - seen.expected) <= kAlarm * seen.deviation) return seen;
  // Starts from the given pose, and from the one that was just found.
  seen.held_px = std::numeric_limits<double>::infinity();
  loose.camera.aspect = seen.expected;
  for (const sensor::Camera& from : {loose.camera, free.camera}) {
    loose.camera = from;
    loose.camera.aspect = seen.expected;
    const Geometry held = fitGeometry(loose, place_px, present, heldAspect);
    const double longer = held.camera.focal_px / start.camera.focal_px;
    const bool isPlausible = std::max(longer, 1.0 / longer) < 1.0 + kLargestFocal;
    if (held.outcome == Geometry::Outcome::kConverged && isPlausible)
      seen.held_px = std::min(seen.held_px, held.residual_px);
  }
  seen.differs = seen.residual_px < kBetter * seen.held_px;
  return seen;
}

}  // namespace tractiond::calibrate
