// Quantities that a single picture does not distinguish are one finding: pitch, focal length and distance make the
// scale of the picture; of the depths of the layers only the difference is visible, in the ratio of their scales.
#include "daemon/calibrate/gel_check.h"

#include "daemon/calibrate/aspect_check.h"
#include "daemon/calibrate/geometry_fit.h"
#include "daemon/calibrate/picture_look.h"

#include <Eigen/Geometry>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace tractiond::calibrate {

namespace {

// Limits beyond which the gel is reported as another one. The deviations are the gel file's [uncertainty], which does
// not cover the pattern. After a calibration the pose is known so well that heat would be reported: hence the floors.
constexpr double kAlarm = 5.0;      // deviations; a gel within its stated uncertainty is reported once in 2e5 zeros
constexpr double kPitch = 3e-4;     // deviation of the pitch, relative
constexpr double kOffset = 0.1e-3;  // deviation of a layer's place relative to the first, in x and in y [m]
constexpr double kLeastPosition = 0.1e-3;  // floor of the deviation of the camera's position [m] ...
constexpr double kLeastRotation = 1e-3;    // ... rotation [rad] ...
constexpr double kLeastDistance = 1e-3;    // ... scale of the picture, relative ...
constexpr double kLeastDepth = 0.05e-3;    // ... and of a layer's depth [m]
constexpr double kSuspicious_px = 0.2;     // residual above which another aspect is tried
constexpr AspectCheckOptions kAspect = {.pattern = 3e-3, .iterations = 15};
// Root mean square residual, as a share of the spacing; a larger one shows another pattern, unless the file states such
// a deviation of the markers' places, times the second number: few markers scatter by more.
constexpr double kLargestResidual = 0.1, kStatedPlaces = 1.5;

/// Fits the camera with the lens of the file, but for its distortion, and the second layer's place and depth. Prior
/// deviations are wide: they only exclude absurd values.
Geometry fitLoosely(const sensor::Sensor& sensor, std::span<const float> place_px,
                    std::span<const std::uint8_t> present) {
  sensor::Sensor loose = sensor;
  loose.uncertainty.focal = loose.uncertainty.principal_px = 0.0;
  loose.uncertainty.k1 = 0.35;
  loose.uncertainty.k2 = 5.0;
  return fitGeometry(loose, place_px, present, {.depth = 0.1, .holdsFirst = true, .pitch = 0.0, .shift = 0.1});
}

/// Collects findings, and sentences about those that contradict the gel file.
class Findings {
 public:
  explicit Findings(const sensor::Sensor& sensor)
      : sensor_(sensor) {}

  void compareCounts(std::span<const LatticeSeen> seen) {
    for (std::size_t i = 0; i < std::min(seen.size(), sensor_.layers.size()); ++i) {
      const sensor::MarkerLayer& layer = sensor_.layers[i];
      const std::string name = nameOf(layer.colour);
      const bool columns = add(name + "_columns", layer.columns, seen[i].columns, 0.0);
      const bool rows = add(name + "_rows", layer.rows, seen[i].rows, 0.0);
      if (!columns && !rows) continue;
      otherGrid_ = true;
      say(fmt::format(
          "the file has {} x {} {} markers (columns x rows), the picture shows {} x {}: correct it in [[layers]]",
          layer.columns, layer.rows, name, seen[i].columns, seen[i].rows));
    }
  }

  /// Adds the finding that the picture's scale differs along v; the other findings are not valid then.
  void addAspect(const AspectSeen& seen) {
    report_.findings.push_back({"aspect", seen.expected, seen.aspect, seen.deviation, true});
    say(seen.what() + ": " + seen.remedy());
  }

  void compareFit(const Geometry& fit, std::span<const LatticeSeen> seen, bool judgesResidual) {
    const BetweenLayers between = layers(fit);
    if (!report_.remark.empty()) {
      // To mend single numbers would then make a gel file that fits, and has mirrored forces.
      const std::string look = otherLook(sensor_, seen, between);
      if (!look.empty()) {
        report_.otherLook = otherGrid_ = true;
        report_.remark = look;
      }
    }
    pose(fit);
    const double stated = sensor_.uncertainty.markerPlace / sensor_.layers.front().pitch;
    const double limit = std::max(kLargestResidual, kStatedPlaces * stated) * spacing_px();
    if (!judgesResidual || !add("residual_px", 0.0, fit.residual_px, limit / kAlarm)) return;
    say(fmt::format("{} markers are {:.1f} px (rms) from where the pattern of the file has them: is it that of another "
                    "gel, or was the zero taken under a load?",
                    fit.markers, fit.residual_px));
    if (sensor_.body) return;  // whose file states no such deviation
    report_.remark += fmt::format(
        " If they were placed by hand, write marker_place_mm = {:.2f} into [uncertainty]: their places are measured in "
        "each zero",
        1e3 * sensor_.layers.front().pitch * fit.residual_px / spacing_px());
  }

  void say(const std::string& sentence) { report_.remark += (report_.remark.empty() ? "" : "; ") + sentence; }

  GelReport report() && { return std::move(report_); }

 private:
  bool add(std::string name, double expected, double seen, double deviation) {
    const double limit = deviation > 0.0 ? kAlarm * deviation : 0.5;
    const bool contradicts = !(std::abs(seen - expected) <= limit);
    report_.findings.push_back({std::move(name), expected, seen, deviation, contradicts});
    return contradicts;
  }

  double meanDepth() const {
    double sum = 0.0;
    for (const sensor::MarkerLayer& layer : sensor_.layers) sum += layer.depth;
    return sum / static_cast<double>(sensor_.layers.size());
  }

  double spacing_px() const {
    return sensor_.camera.focal_px * sensor_.layers.front().pitch / (sensor_.camera.position.z() - meanDepth());
  }

  BetweenLayers layers(const Geometry& fit) {
    if (sensor_.layers.size() < 2) return {};
    const sensor::MarkerLayer &one = sensor_.layers[0], &other = sensor_.layers[1];
    const double depth = std::max(sensor_.uncertainty.layerDepth, kLeastDepth);
    // The ratio of the layers' scales gives the distance between them; it includes the errors of their pitches.
    const double distance = sensor_.camera.position.z() - meanDepth();
    const double deviation = 1e3 * std::sqrt(2.0 * depth * depth + 2.0 * std::pow(kPitch * distance, 2) +
                                             std::pow(fit.offsetDeviation[0], 2));
    const double expected = 1e3 * (other.depth - one.depth), seen = expected + 1e3 * fit.offset[0];
    if (add("layer_distance_mm", expected, seen, deviation)) {
      otherLayers_ = true;
      const bool exchanged = std::abs(seen + expected) < kAlarm * deviation;
      say(fmt::format(
          "the {} markers lie {:.2f} mm {} the {} ones by the file, {:.2f} ± {:.2f} mm {} by the picture: {}",
          nameOf(other.colour), std::abs(expected), expected < 0.0 ? "above" : "below", nameOf(one.colour),
          std::abs(seen), deviation, seen < 0.0 ? "above" : "below",
          exchanged ? "depth_mm of the two layers seems to be exchanged"
                    : "check depth_mm (and pitch_mm) of both layers"));
    }
    BetweenLayers between;
    between.difference.z() = 1e-3 * seen;
    between.deviation.z() = 1e-3 * deviation;
    for (const int axis : {0, 1}) {
      const double offset = 1e3 * std::hypot(kOffset, fit.offsetDeviation[1 + axis]);
      between.deviation[axis] = 1e-3 * offset;
      between.difference[axis] = other.centre[axis] - one.centre[axis] + fit.offset[1 + axis];
      const double has = 1e3 * (other.centre[axis] - one.centre[axis]);
      if (add(axis == 0 ? "layer_offset_x_mm" : "layer_offset_y_mm", has, has + 1e3 * fit.offset[1 + axis], offset)) {
        say(fmt::format("the {} markers are {:+.2f} mm from the {} ones in {} by the file, {:+.2f} ± {:.2f} mm by the "
                        "picture: check centre_mm and colour of both layers",
                        nameOf(other.colour), has, nameOf(one.colour), axis == 0 ? "x" : "y",
                        has + 1e3 * fit.offset[1 + axis], offset));
      }
    }
    return between;
  }

  void pose(const Geometry& fit) {
    const sensor::Camera &file = sensor_.camera, &seen = fit.camera;
    const sensor::Uncertainty& known = sensor_.uncertainty;
    const double distance = file.position.z() - meanDepth();
    // An error of the focal length in the file has the same effect as an error of the distance.
    const double focal = distance * known.focal;
    const double scale =
        std::hypot(kPitch * distance,
                   std::sqrt(std::max(0.0, known.position.z() * known.position.z() + focal * focal -
                                               2.0 * known.focalDistance * known.position.z() * focal)),
                   known.layerDepth);
    const double ofDistance = std::hypot(std::max(scale, kLeastDistance * distance), fit.uncertainty.position.z());

    bool moved = false;
    for (const int axis : {0, 1}) {
      // An error of the principal point in the file has the same effect as an error of the position.
      const double deviation =
          std::hypot(std::max(known.position[axis], kLeastPosition),
                     known.principal_px * distance / (file.focal_px * (axis == 1 ? file.aspect : 1.0)),
                     fit.uncertainty.position[axis]);
      moved = add(axis == 0 ? "camera_x_mm" : "camera_y_mm", 1e3 * file.position[axis], 1e3 * seen.position[axis],
                  1e3 * deviation) ||
              moved;
    }
    constexpr std::array<const char*, 3> kRotations = {"camera_rotation_x_rad", "camera_rotation_y_rad",
                                                       "camera_rotation_z_rad"};
    for (const int axis : {0, 1, 2}) {
      const double deviation =
          std::hypot(std::max(known.rotation[axis], kLeastRotation), fit.uncertainty.rotation[axis]);
      moved = add(kRotations[axis], file.rotation[axis], seen.rotation[axis], deviation) || moved;
    }
    const bool scaled = add("camera_z_mm", 1e3 * file.position.z(), 1e3 * seen.position.z(), 1e3 * ofDistance);
    // The same difference, if it is that of the pitch.
    const double pitch = 1e3 * sensor_.layers.front().pitch;
    const double seenPitch = pitch * distance / (distance + seen.position.z() - file.position.z());
    const double ofPitch = pitch * ofDistance / distance;
    add("pitch_mm", pitch, seenPitch, ofPitch);
    if (otherGrid_) return;  // the assignment of the rows, and therefore the pose, is a guess then, or the look another
    if (moved) {
      const Eigen::Matrix3d turn = sensor::toCamera(seen) * sensor::toCamera(file).transpose();
      const double angle = Eigen::AngleAxisd(turn).angle();
      const Eigen::Vector3d by = 1e3 * (seen.position - file.position);
      say(fmt::format(
          "the camera's pose in the file is off by {:.1f} mm ({:+.1f}, {:+.1f}, {:+.1f}) and {:.2f}°, more than "
          "[uncertainty] says: measure it with tractionctl calibrate",
          by.norm(), by.x(), by.y(), by.z(), angle * 180.0 / M_PI));
    } else if (scaled && !otherLayers_) {
      say(fmt::format(
          "the markers' pitch is {:.3f} mm by the file, {:.3f} ± {:.3f} mm by the picture if the camera is where "
          "the file has it; or the camera is {:.1f} mm {}: check pitch_mm, and if it is right, measure the pose "
          "with tractionctl calibrate",
          pitch, seenPitch, ofPitch, 1e3 * std::abs(seen.position.z() - file.position.z()),
          seen.position.z() > file.position.z() ? "farther" : "nearer"));
    }
  }

  const sensor::Sensor& sensor_;
  GelReport report_;
  bool otherGrid_ = false, otherLayers_ = false;
};

}  // namespace

GelReport checkGel(const sensor::Sensor& sensor, std::span<const float> place_px, std::span<const std::uint8_t> present,
                   std::span<const LatticeSeen> seen, bool judgesResidual) {
  Findings findings(sensor);
  findings.compareCounts(seen);
  const Geometry fit = fitLoosely(sensor, place_px, present);
  const bool isFound = fit.outcome == Geometry::Outcome::kConverged;
  if (!isFound || (judgesResidual && fit.residual_px > kSuspicious_px)) {
    // The pose of the file is the better start, as the fitted pose has compensated for the scale.
    auto found = seenAspect(sensor, sensor.camera.aspect, place_px, present, kAspect);
    if (!found && isFound) {
      sensor::Sensor posed = sensor;
      posed.camera = fit.camera;
      found = seenAspect(posed, posed.camera.aspect, place_px, present, kAspect);
    }
    if (found && found->differs) {
      findings.addAspect(*found);
      return std::move(findings).report();
    }
  }
  if (isFound) {
    findings.compareFit(fit, seen, judgesResidual);
  } else if (sensor.markerCount() >= sensor::kVerifying) {
    findings.say("no camera explains the markers' places: is the gel file that of another gel?");
  }
  return std::move(findings).report();
}

}  // namespace tractiond::calibrate
