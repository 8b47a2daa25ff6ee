#include "daemon/calibrate/aspect_check.h"

#include "daemon/calibrate/geometry_fit.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace tractiond::calibrate {

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
  sensor::Sensor loose = start;
  loose.uncertainty.focal = std::max(loose.uncertainty.focal, options.focal);
  loose.uncertainty.principal_px = std::max(loose.uncertainty.principal_px, options.principal_px);
  loose.uncertainty.k1 = std::max(loose.uncertainty.k1, options.k1);
  loose.uncertainty.k2 = std::max(loose.uncertainty.k2, options.k2);
  AspectSeen seen;
  seen.expected = start.camera.aspect;
  loose.camera.aspect = first;
  GeometryOptions heldAspect, anyAspect;
  heldAspect.iterations = anyAspect.iterations = options.iterations;
  anyAspect.aspect = std::numeric_limits<double>::infinity();
  const Geometry free = fitGeometry(loose, place_px, present, anyAspect);
  if (free.outcome != Geometry::Outcome::kConverged || free.residual_px > options.largestResidual_px) {
    return std::nullopt;
  }
  seen.aspect = free.camera.aspect;
  seen.residual_px = free.residual_px;
  seen.deviation = std::hypot(free.aspectDeviation, options.pattern * seen.aspect);
  if (std::abs(seen.aspect - seen.expected) <= options.alarm * seen.deviation) return seen;
  // Starts from the given pose, and from the one that was just found.
  seen.held_px = std::numeric_limits<double>::infinity();
  loose.camera.aspect = seen.expected;
  for (const sensor::Camera& from : {loose.camera, free.camera}) {
    loose.camera = from;
    loose.camera.aspect = seen.expected;
    const Geometry held = fitGeometry(loose, place_px, present, heldAspect);
    const double longer = held.camera.focal_px / start.camera.focal_px;
    const bool isPlausible = std::max(longer, 1.0 / longer) < 1.0 + options.largestFocal;
    if (held.outcome == Geometry::Outcome::kConverged && isPlausible)
      seen.held_px = std::min(seen.held_px, held.residual_px);
  }
  seen.differs = seen.residual_px < options.better * seen.held_px;
  return seen;
}

}  // namespace tractiond::calibrate
