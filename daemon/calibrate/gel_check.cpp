// Solves least squares by Gauss-Newton steps, which are shortened if they do not reduce the residual: the pose in the
// file may be wrong by centimetres. Quantities that a single picture does not distinguish are one finding: pitch, focal
// length and distance make the scale of the picture; of the depths of the layers only the difference is visible, in the
// ratio of their scales.
#include "daemon/calibrate/gel_check.h"

#include "daemon/calibrate/aspect_check.h"
#include "sensor/colour_name.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <optional>

namespace tractiond::calibrate {

namespace {

constexpr int kPosition = 0, kRotation = 3, kDistortion = 6, kLayer = 8, kUnknowns = 11;
constexpr int kFewest = 50;  // markers
constexpr int kIterations = 40;
constexpr double kSettled = 1e-4;  // step that ends the iteration, in the units below
constexpr int kTrims = 2;
constexpr double kOutlier = 5.0;             // times the scatter, which is estimated by the median
constexpr double kMedianOfRayleigh = 1.177;  // median length, in deviations of a coordinate
constexpr double kScatterFloor_px = 1e-3;
constexpr double kStatedPlaces = 1.5;  // times the stated deviation of the places; few markers scatter by more

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// Returns the size of a unit of each unknown: about a pixel.
Unknowns units() {
  Unknowns u;
  u << 0.15e-3, 0.15e-3, 0.6e-3, 1e-3, 1e-3, 4e-3, 0.07, 1.0, 0.6e-3, 0.15e-3, 0.15e-3;
  return u;
}

/// Returns wide prior deviations of the unknowns, in units: they only exclude absurd values.
Unknowns looseDeviations() {
  Unknowns u = Unknowns::Constant(1e3);
  u.segment<2>(kDistortion).setConstant(5.0);
  return u;
}

struct Fit {
  sensor::Camera camera;
  Eigen::Vector3d layer = Eigen::Vector3d::Zero();  ///< offset of the second layer from the file's: depth, x, y [m]
  Unknowns deviation = Unknowns::Zero();            ///< standard deviations by the scatter [m, rad, 1]
  double residual_px = 0.0;
};

class Problem {
 public:
  Problem(const sensor::Sensor& sensor, std::span<const float> place_px, std::span<const std::uint8_t> present)
      : sensor_(sensor)
      , markers_(sensor::markerPositions(sensor))
      , firstOfSecond_(sensor.layers.front().count()) {
    const bool two = sensor.layers.size() > 1;
    free_ = two ? kUnknowns : kLayer;
    for (Eigen::Index i = 0; i < markers_.cols(); ++i) {
      if (present[static_cast<std::size_t>(i)] == 0) continue;
      used_.push_back(i);
      seen_.emplace_back(place_px[2 * static_cast<std::size_t>(i)], place_px[2 * static_cast<std::size_t>(i) + 1]);
    }
  }

  int used() const { return static_cast<int>(used_.size()); }

  std::optional<Fit> run() {
    Unknowns x = Unknowns::Zero();
    for (int trims = 0;; ++trims) {
      if (used() < kFewest) return std::nullopt;
      if (!settle(x)) return std::nullopt;
      if (trims == kTrims || !trim(x)) break;
    }
    Fit fit;
    fit.camera = camera(x);
    fit.layer = x.tail<3>().cwiseProduct(units().tail<3>());
    const double scatter2 = std::max(squares(x) / (2 * used() - free_), kScatterFloor_px * kScatterFloor_px);
    fit.residual_px = std::sqrt(squares(x) / (2 * used()));
    const Normal covariance = scatter2 * normal_.ldlt().solve(Normal::Identity());
    fit.deviation = covariance.diagonal().cwiseSqrt().cwiseProduct(units());
    return fit;
  }

 private:
  sensor::Camera camera(const Unknowns& x) const {
    const Unknowns change = x.cwiseProduct(units());
    sensor::Camera camera = sensor_.camera;
    camera.position += change.segment<3>(kPosition);
    camera.rotation += change.segment<3>(kRotation);
    camera.k1 += change[kDistortion];
    camera.k2 += change[kDistortion + 1];
    return camera;
  }

  /// Calls visit(number, predicted place) for each used marker. Returns false if no camera can have this pose.
  template <typename Visit>
  bool project(const Unknowns& x, Visit&& visit) const {
    const sensor::Camera seen = camera(x);
    if (!sensor::isBehindWindow(seen, sensor_.gel.size.z())) return false;
    const sensor::Projection projection(seen, sensor_.gel.size.z());
    const Eigen::Vector3d layer = x.tail<3>().cwiseProduct(units().tail<3>());
    for (std::size_t i = 0; i < used_.size(); ++i) {
      Eigen::Vector3d point = markers_.col(used_[i]);
      if (used_[i] >= firstOfSecond_) point += Eigen::Vector3d(layer[1], layer[2], layer[0]);
      point.z() = std::min(point.z(), sensor_.gel.size.z());
      visit(i, projection(point));
    }
    return true;
  }

  double squares(const Unknowns& x) const {
    double sum = 0.0;
    const bool possible =
        project(x, [&](std::size_t i, const Eigen::Vector2d& place) { sum += (seen_[i] - place).squaredNorm(); });
    return possible && std::isfinite(sum) ? sum : std::numeric_limits<double>::infinity();
  }

  double cost(const Unknowns& x) const { return squares(x) + x.cwiseQuotient(looseDeviations()).squaredNorm(); }

  bool settle(Unknowns& x) {
    constexpr double kStep = 1e-3;
    Eigen::Matrix<double, Eigen::Dynamic, kUnknowns> jacobian(2 * used_.size(), kUnknowns);
    Eigen::VectorXd residual(2 * used_.size());
    double before = cost(x);
    if (!std::isfinite(before)) return false;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      project(x, [&](std::size_t i, const Eigen::Vector2d& place) {
        residual.segment<2>(2 * static_cast<Eigen::Index>(i)) = seen_[i] - place;
      });
      jacobian.setZero();
      for (int k = 0; k < free_; ++k) {
        for (const double side : {1.0, -1.0}) {
          Unknowns moved = x;
          moved[k] += side * kStep;
          project(moved, [&](std::size_t i, const Eigen::Vector2d& place) {
            jacobian.block<2, 1>(2 * static_cast<Eigen::Index>(i), k) += side / (2.0 * kStep) * place;
          });
        }
      }
      const Unknowns weight = looseDeviations().cwiseAbs2().cwiseInverse();
      normal_ = jacobian.transpose() * jacobian;
      normal_.diagonal() += weight;
      const Unknowns change = normal_.ldlt().solve(jacobian.transpose() * residual - weight.cwiseProduct(x));
      if (!change.allFinite()) return false;
      double share = 1.0, after = cost(x + change);
      for (; after > before && share > 1e-3; after = cost(x + share * change)) share *= 0.5;
      if (after > before) return true;  // the minimum is reached
      x += share * change;
      before = after;
      if (share * change.cwiseAbs().maxCoeff() < kSettled) return true;
    }
    return std::isfinite(before);
  }

  /// Drops outliers: dust, misplaced markers, markers that a touch displaces. Returns false if there are none.
  bool trim(const Unknowns& x) {
    std::vector<double> distances(used_.size());
    project(x, [&](std::size_t i, const Eigen::Vector2d& place) { distances[i] = (seen_[i] - place).norm(); });
    std::vector<double> sorted = distances;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    const double limit = kOutlier * *middle / kMedianOfRayleigh + kScatterFloor_px;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < used_.size(); ++i) {
      if (distances[i] > limit) continue;
      used_[kept] = used_[i];
      seen_[kept++] = seen_[i];
    }
    const bool any = kept < used_.size();
    used_.resize(kept);
    seen_.resize(kept);
    return any;
  }

  const sensor::Sensor& sensor_;
  sensor::Points markers_;
  Eigen::Index firstOfSecond_;
  int free_ = kUnknowns;
  std::vector<Eigen::Index> used_;
  std::vector<Eigen::Vector2d> seen_;
  Normal normal_ = Normal::Identity();
};

/// Collects findings, and sentences about those that contradict the gel file.
class Findings {
 public:
  Findings(const sensor::Sensor& sensor, const GelCheckOptions& options)
      : sensor_(sensor)
      , options_(options) {}

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

  void compareFit(const Fit& fit, int markers) {
    layers(fit);
    pose(fit);
    const double stated = sensor_.uncertainty.markerPlace / sensor_.layers.front().pitch;
    const double limit = std::max(options_.largestResidual, kStatedPlaces * stated) * spacing_px();
    report_.findings.push_back({"residual_px", 0.0, fit.residual_px, limit / options_.alarm, fit.residual_px > limit});
    if (fit.residual_px > limit) {
      std::string remark = fmt::format(
          "{} markers are {:.1f} px (rms) from where the pattern of the file has them: is it that of another "
          "gel, or was the zero taken under a load?",
          markers, fit.residual_px);
      if (!sensor_.body) {  // whose file states no such deviation
        remark += fmt::format(
            " If they were placed by hand, write marker_place_mm = {:.2f} into [uncertainty]: their places are "
            "measured in each zero",
            1e3 * sensor_.layers.front().pitch * fit.residual_px / spacing_px());
      }
      say(remark);
    }
  }

  void say(const std::string& sentence) { report_.remark += (report_.remark.empty() ? "" : "; ") + sentence; }

  GelReport report() && { return std::move(report_); }

 private:
  bool add(const char* name, double expected, double seen, double deviation) {
    return add(std::string(name), expected, seen, deviation);
  }

  bool add(std::string name, double expected, double seen, double deviation) {
    const double limit = deviation > 0.0 ? options_.alarm * deviation : 0.5;
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

  void layers(const Fit& fit) {
    if (sensor_.layers.size() < 2) return;
    const sensor::MarkerLayer &one = sensor_.layers[0], &other = sensor_.layers[1];
    const double depth = std::max(sensor_.uncertainty.layerDepth, options_.leastDepth);
    // The ratio of the layers' scales gives the distance between them; it includes the errors of their pitches.
    const double distance = sensor_.camera.position.z() - meanDepth();
    const double deviation = 1e3 * std::sqrt(2.0 * depth * depth + 2.0 * std::pow(options_.pitch * distance, 2) +
                                             std::pow(fit.deviation[kLayer], 2));
    const double expected = 1e3 * (other.depth - one.depth), seen = expected + 1e3 * fit.layer[0];
    if (add("layer_distance_mm", expected, seen, deviation)) {
      otherLayers_ = true;
      const bool exchanged = std::abs(seen + expected) < options_.alarm * deviation;
      say(fmt::format(
          "the {} markers lie {:.2f} mm {} the {} ones by the file, {:.2f} ± {:.2f} mm {} by the picture: {}",
          nameOf(other.colour), std::abs(expected), expected < 0.0 ? "above" : "below", nameOf(one.colour),
          std::abs(seen), deviation, seen < 0.0 ? "above" : "below",
          exchanged ? "depth_mm of the two layers seems to be exchanged"
                    : "check depth_mm (and pitch_mm) of both layers"));
    }
    for (const int axis : {0, 1}) {
      const double offset = 1e3 * std::hypot(options_.offset, fit.deviation[kLayer + 1 + axis]);
      const double has = 1e3 * (other.centre[axis] - one.centre[axis]);
      if (add(axis == 0 ? "layer_offset_x_mm" : "layer_offset_y_mm", has, has + 1e3 * fit.layer[1 + axis], offset)) {
        say(fmt::format("the {} markers are {:+.2f} mm from the {} ones in {} by the file, {:+.2f} ± {:.2f} mm by the "
                        "picture: check centre_mm and colour of both layers",
                        nameOf(other.colour), has, nameOf(one.colour), axis == 0 ? "x" : "y",
                        has + 1e3 * fit.layer[1 + axis], offset));
      }
    }
  }

  void pose(const Fit& fit) {
    const sensor::Camera &file = sensor_.camera, &seen = fit.camera;
    const sensor::Uncertainty& known = sensor_.uncertainty;
    const double distance = file.position.z() - meanDepth();
    // An error of the focal length in the file has the same effect as an error of the distance.
    const double focal = distance * known.focal;
    const double scale =
        std::hypot(options_.pitch * distance,
                   std::sqrt(std::max(0.0, known.position.z() * known.position.z() + focal * focal -
                                               2.0 * known.focalDistance * known.position.z() * focal)),
                   known.layerDepth);
    const double ofDistance =
        std::hypot(std::max(scale, options_.leastDistance * distance), fit.deviation[kPosition + 2]);

    bool moved = false;
    for (const int axis : {0, 1}) {
      // An error of the principal point in the file has the same effect as an error of the position.
      const double deviation = std::hypot(
          std::max(known.position[axis], options_.leastPosition),
          known.principal_px * distance / (file.focal_px * (axis == 1 ? file.aspect : 1.0)), fit.deviation[axis]);
      moved = add(axis == 0 ? "camera_x_mm" : "camera_y_mm", 1e3 * file.position[axis], 1e3 * seen.position[axis],
                  1e3 * deviation) ||
              moved;
    }
    constexpr std::array<const char*, 3> kRotations = {"camera_rotation_x_rad", "camera_rotation_y_rad",
                                                       "camera_rotation_z_rad"};
    for (const int axis : {0, 1, 2}) {
      const double deviation =
          std::hypot(std::max(known.rotation[axis], options_.leastRotation), fit.deviation[kRotation + axis]);
      moved = add(kRotations[axis], file.rotation[axis], seen.rotation[axis], deviation) || moved;
    }
    const bool scaled = add("camera_z_mm", 1e3 * file.position.z(), 1e3 * seen.position.z(), 1e3 * ofDistance);
    // The same difference, if it is that of the pitch.
    const double pitch = 1e3 * sensor_.layers.front().pitch;
    const double seenPitch = pitch * distance / (distance + seen.position.z() - file.position.z());
    const double ofPitch = pitch * ofDistance / distance;
    add("pitch_mm", pitch, seenPitch, ofPitch);
    if (otherGrid_) return;  // the assignment of the rows, and therefore the pose, is a guess then
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
  const GelCheckOptions& options_;
  GelReport report_;
  bool otherGrid_ = false, otherLayers_ = false;
};

}  // namespace

GelReport checkGel(const sensor::Sensor& sensor, std::span<const float> place_px, std::span<const std::uint8_t> present,
                   std::span<const LatticeSeen> seen, const GelCheckOptions& options) {
  Findings findings(sensor, options);
  findings.compareCounts(seen);
  Problem problem(sensor, place_px, present);
  const auto fit = problem.run();
  if (!fit || fit->residual_px > options.suspicious_px) {
    AspectCheckOptions aspect;
    aspect.alarm = options.alarm;
    aspect.pattern = options.aspect;
    aspect.iterations = options.aspectIterations;
    // The pose of the file is the better start, as the fitted pose has compensated for the scale.
    auto found = seenAspect(sensor, sensor.camera.aspect, place_px, present, aspect);
    if (!found && fit) {
      sensor::Sensor posed = sensor;
      posed.camera = fit->camera;
      found = seenAspect(posed, posed.camera.aspect, place_px, present, aspect);
    }
    if (found && found->differs) {
      findings.addAspect(*found);
      return std::move(findings).report();
    }
  }
  if (fit) {
    findings.compareFit(*fit, problem.used());
  } else {
    findings.say("no camera explains the markers' places: is the gel file that of another gel?");
  }
  return std::move(findings).report();
}

}  // namespace tractiond::calibrate
