#include "daemon/calibrate/zero_check.h"

#include "daemon/calibrate/geometry_fit.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace tractiond::calibrate {
namespace {

/// Displacements of the markers from one zero to another.
struct Moved {
  std::vector<float> value_px;
  std::vector<std::uint8_t> valid;

  Moved(const RestPose& before, const RestPose& after)
      : value_px(after.position_px)
      , valid(after.present) {
    for (std::size_t i = 0; i < valid.size(); ++i) {
      valid[i] = after.present[i] != 0 && before.present[i] != 0 ? 1 : 0;
      value_px[2 * i] -= before.position_px[2 * i];
      value_px[2 * i + 1] -= before.position_px[2 * i + 1];
    }
  }
};

}  // namespace

std::string touching(const Bulge& bulge) {
  return fmt::format(
      "something seems to touch the gel near ({:.0f}, {:.0f}) mm: the markers there are displaced by {:.2f} px",
      1e3 * bulge.place.x(), 1e3 * bulge.place.y(), bulge.size_px);
}

std::string movedBetween(const sensor::Sensor& sensor, const RestPose& before, const RestPose& after) {
  const Moved moved(before, after);
  const auto motion = PictureMotionFit(sensor)({moved.value_px, moved.valid});
  if (!motion) return "";
  return fmt::format("the picture is moved by ({:+.3f}, {:+.3f}) px, scale {:+.1e}, roll {:+.1e} rad, the markers by "
                     "{:.3f} px besides, against the zero before",
                     motion->value[0], motion->value[1], motion->value[2], motion->value[3], motion->rms_px);
}

std::string touchSince(const sensor::Sensor& sensor, const RestPose& before, const RestPose& after) {
  const Moved moved(before, after);
  const PictureMotionFit fit(sensor);
  const auto motion = fit({moved.value_px, moved.valid});
  if (!motion) return "";
  const std::vector<float> remains_px = fit.without(motion->value, moved.value_px);
  const Bulge bulge = largestBulge(sensor, {remains_px, moved.valid}, kUntouched_px);
  return bulge.found() ? touching(bulge) : "";
}

std::string touchIn(const sensor::Sensor& sensor, const RestPose& zero) {
  if (sensor.body) return "";  // a bulge can only be seen in flat layers
  const Geometry found = fitGeometry(sensor, zero.position_px, zero.present, {});
  if (found.outcome != Geometry::Outcome::kConverged || !found.bulge.found()) return "";
  return touching(found.bulge) + " (markers that are damaged or printed off their places look the same)";
}

std::string recovering(const MarkerField& markers) {
  const auto coordinates = std::ssize(markers.displacement_px);
  if (markers.creepErrors_px.empty()) return "";
  const auto map = [coordinates](const std::vector<float>& values) {
    return Eigen::Map<const Eigen::MatrixXf>(values.data(), coordinates, std::ssize(values) / coordinates);
  };
  // Of the valid markers alone: the others' displacements are 0, and so are these.
  Eigen::VectorXf taken = map(markers.displacement_px) - map(markers.elastic_px);
  if (!markers.drift_px.empty()) taken -= map(markers.drift_px);
  const Eigen::VectorXf squares = taken.cwiseAbs2() + map(markers.creepErrors_px).rowwise().squaredNorm();
  const float largest_px = std::sqrt(squares.reshaped(2, coordinates / 2).colwise().sum().maxCoeff());
  if (largest_px <= kUntouched_px) return "";
  return fmt::format("the gel still recovers from earlier loads, which displace markers by up to {:.2f} px",
                     largest_px);
}

}  // namespace tractiond::calibrate
