#include "lens/first_pose.h"

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>

namespace lens {

std::optional<sensor::Camera> solvePose(const sensor::Sensor& sensor, const RestMarkers& markers) {
  sensor::Camera camera = sensor.camera;
  const sensor::Points points = sensor::markerPositions(sensor);
  const double surface = sensor.gel.size.z() + camera.windowThickness;
  std::vector<cv::Point3d> objects;
  std::vector<cv::Point2d> places;
  for (std::size_t i = 0; i < markers.present.size(); ++i) {
    if (markers.present[i] == 0) continue;
    const Eigen::Vector3d point = points.col(static_cast<Eigen::Index>(i));
    const double apparentDepth =
        camera.windowThickness / camera.windowIndex + (sensor.gel.size.z() - point.z()) / camera.gelIndex;
    objects.emplace_back(point.x(), point.y(), surface - apparentDepth);
    places.emplace_back(markers.place_px[2 * i], markers.place_px[2 * i + 1]);
  }
  if (objects.size() < 4) return std::nullopt;
  const cv::Mat lens = (cv::Mat_<double>(3, 3) << camera.focal_px, 0, camera.principal_px.x(), 0,
                        camera.aspect * camera.focal_px, camera.principal_px.y(), 0, 0, 1);
  const cv::Mat distortion = (cv::Mat_<double>(4, 1) << camera.k1, camera.k2, 0, 0);
  cv::Mat rotation, translation, turn;
  try {
    if (!cv::solvePnP(objects, places, lens, distortion, rotation, translation, false, cv::SOLVEPNP_SQPNP)) {
      return std::nullopt;
    }
    cv::solvePnPRefineLM(objects, places, lens, distortion, rotation, translation);
    cv::Rodrigues(rotation, turn);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  // seen = turn point + translation = exp(rotation) diag(1, -1, -1) (point - position)
  const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> toCamera(turn.ptr<double>());
  const Eigen::Map<const Eigen::Vector3d> shift(translation.ptr<double>());
  const Eigen::AngleAxisd off(Eigen::Matrix3d(toCamera * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal()));
  camera.rotation = off.angle() * off.axis();
  camera.position = -toCamera.transpose() * shift;
  if (!camera.position.allFinite() || camera.position.z() <= surface) return std::nullopt;
  return camera;
}

tractiond::calibrate::Geometry firstPose(const sensor::Sensor& sensor, const RestMarkers& markers) {
  const auto start = solvePose(sensor, markers);
  if (!start) {
    tractiond::calibrate::Geometry none;
    none.outcome = tractiond::calibrate::Geometry::Outcome::kDiverged;
    return none;
  }
  sensor::Sensor posed = sensor;
  posed.camera = *start;
  return tractiond::calibrate::fitGeometry(posed, markers.place_px, markers.present);
}

std::optional<tractiond::calibrate::AspectSeen> otherAspect(const sensor::Sensor& sensor, const RestMarkers& markers) {
  // From one that is far off, no pose may be found: those of fields, of films and of pictures that were squeezed.
  for (const double share : {1.0, 0.9, 1.1, 0.8, 1.25, 0.5, 2.0}) {
    sensor::Sensor start = sensor;
    start.camera.aspect *= share;
    const auto posed = solvePose(start, markers);
    if (!posed) continue;
    start.camera = *posed;
    start.camera.aspect = sensor.camera.aspect;
    const auto seen = tractiond::calibrate::seenAspect(start, posed->aspect, markers.place_px, markers.present);
    if (seen) return seen->differs ? seen : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace lens
