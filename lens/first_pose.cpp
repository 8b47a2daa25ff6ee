#include "lens/first_pose.h"

#include "daemon/track/lattice.h"

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace lens {

namespace {

/// Returns where a pinhole without refraction would see the markers from everywhere near the camera: along the line of
/// sight, as far away as the line turns when the camera is moved sideways.
sensor::Points apparentMarkers(const sensor::Sensor& sensor) {
  constexpr double kStep = 1e-4;                    // [m]
  const auto from = [&](double right, double up) {  // projects to slopes along x and -y, for each metre along -z
    sensor::Camera plain = sensor.camera;
    plain.focal_px = plain.aspect = 1.0;
    plain.principal_px.setZero();
    plain.rotation.setZero();
    plain.k1 = plain.k2 = 0.0;
    plain.fisheye = false;
    plain.position += Eigen::Vector3d(right, up, 0.0);
    return sensor::Projection(plain, sensor.gel.size.z());
  };
  const sensor::Projection here = from(0.0, 0.0), left = from(-kStep, 0.0), right = from(kStep, 0.0),
                           below = from(0.0, -kStep), above = from(0.0, kStep);
  sensor::Points points = sensor::markerPositions(sensor);
  for (auto point : points.colwise()) {
    const Eigen::Vector3d marker = point;
    const double turned = (left(marker) - right(marker)).x() - (below(marker) - above(marker)).y();
    const Eigen::Vector2d seen = here(marker);
    point = sensor.camera.position + 4.0 * kStep / turned * Eigen::Vector3d(seen.x(), -seen.y(), -1.0);
  }
  return points;
}

}  // namespace

std::optional<sensor::Camera> solvePose(const sensor::Sensor& sensor, const RestMarkers& markers) {
  sensor::Camera camera = sensor.camera;
  const sensor::Points points = apparentMarkers(sensor);
  std::vector<cv::Point3d> objects;
  std::vector<cv::Point2d> places;
  for (std::size_t i = 0; i < markers.present.size(); ++i) {
    if (markers.present[i] == 0) continue;
    const Eigen::Vector3d point = points.col(static_cast<Eigen::Index>(i));
    objects.emplace_back(point.x(), point.y(), point.z());
    places.emplace_back(markers.place_px[2 * i], markers.place_px[2 * i + 1]);
  }
  if (objects.size() < 4) return std::nullopt;
  const cv::Mat lens = (cv::Mat_<double>(3, 3) << camera.focal_px, 0, camera.principal_px.x(), 0,
                        camera.aspect * camera.focal_px, camera.principal_px.y(), 0, 0, 1);
  cv::Mat distortion = (cv::Mat_<double>(4, 1) << camera.k1, camera.k2, 0, 0);
  if (camera.fisheye) {
    const cv::Mat ofFisheye = (cv::Mat_<double>(4, 1) << camera.k1, camera.k2, camera.k3, camera.k4);
    cv::fisheye::undistortPoints(places, places, lens, ofFisheye, cv::noArray(), lens);
    distortion = cv::Mat::zeros(4, 1, CV_64F);
  }
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
  sensor::setToCamera(camera, toCamera);
  camera.position = -toCamera.transpose() * shift;
  if (!camera.position.allFinite() || !sensor::isBehindWindow(camera, sensor.gel.size.z())) return std::nullopt;
  return camera;
}

namespace {

using tractiond::calibrate::Geometry;

/// Returns the camera rotated about the origin of the gel frame, whose direction from the camera does not change.
sensor::Camera tilted(sensor::Camera camera, const Eigen::Vector3d& by_rad) {
  const Eigen::Matrix3d before = sensor::toCamera(camera);
  const Eigen::Matrix3d after = Eigen::AngleAxisd(by_rad.norm(), by_rad.normalized()) * before;
  camera.position = after.transpose() * before * camera.position;
  sensor::setToCamera(camera, after);
  return camera;
}

/// Returns the mean square distance of all markers [px^2]. Outliers count at the limit from which they are outliers.
double misfit(const Geometry& fit) {
  constexpr double kOutlier = tractiond::calibrate::GeometryOptions{}.outlier;
  const double squares = fit.markers + kOutlier * kOutlier * fit.outliers;
  return fit.residual_px * fit.residual_px * squares / (fit.markers + fit.outliers);
}

bool isBetter(const Geometry& one, const Geometry& other) {
  if (one.outcome != Geometry::Outcome::kConverged) return false;
  return other.outcome != Geometry::Outcome::kConverged || misfit(one) < misfit(other);
}

/// Returns the squared distance of the picture's corners from the axis, divided by Z^2.
double cornerRadius2(const sensor::Camera& camera) {
  const Eigen::Vector2d half(0.5 * camera.width / camera.focal_px,
                             0.5 * camera.height / (camera.aspect * camera.focal_px));
  return half.squaredNorm();
}

}  // namespace

Geometry firstPose(const sensor::Sensor& sensor, const RestMarkers& markers) {
  constexpr double kClear_px = 0.1;  // no further start is tried once the residual is at most this
  // Relative distortions at the picture's corners that further starts assume instead of the sensor's, with k2 = 0.
  constexpr std::array kDistortions = {-0.06, -0.12, -0.18, -0.25, 0.06};
  constexpr double kTilt_rad = 0.2;  // by which each start is also tilted towards four sides
  Geometry best;
  best.outcome = Geometry::Outcome::kDiverged;
  const auto fitFrom = [&](const sensor::Camera& start) {
    const Geometry fit = tractiond::calibrate::fitGeometryFrom(start, sensor, markers.place_px, markers.present);
    if (isBetter(fit, best)) best = fit;
  };
  const auto isClear = [&] {
    return best.outcome == Geometry::Outcome::kConverged && std::sqrt(misfit(best)) <= kClear_px;
  };
  sensor::Sensor guess = sensor;
  const auto fitAround = [&] {
    const auto start = solvePose(guess, markers);
    if (!start) return;
    fitFrom(*start);
    for (int side = 0; side < 4 && !isClear(); ++side) {
      const double by = side % 2 == 0 ? kTilt_rad : -kTilt_rad;
      fitFrom(tilted(*start, side < 2 ? Eigen::Vector3d(by, 0, 0) : Eigen::Vector3d(0, by, 0)));
    }
  };
  fitAround();
  for (const double distortion : kDistortions) {
    if (isClear()) break;
    guess.camera.k1 = distortion / cornerRadius2(sensor.camera);
    guess.camera.k2 = 0.0;
    fitAround();
  }
  return best;
}

namespace {

/// Returns the markers with other labels: further columns and rows. Those beyond the grid are left out.
RestMarkers moved(const sensor::Sensor& sensor, const RestMarkers& markers, int columns, int rows) {
  RestMarkers result = markers;
  std::ranges::fill(result.present, 0);
  for (const tractiond::track::Lattice& lattice : tractiond::track::latticesOf(sensor)) {
    for (int row = 0; row < lattice.rows; ++row) {
      for (int column = 0; column < lattice.columns; ++column) {
        if (!lattice.has(column + columns, row + rows)) continue;
        const auto from = static_cast<std::size_t>(lattice.at(column, row));
        const auto to = static_cast<std::size_t>(lattice.at(column + columns, row + rows));
        result.present[to] = markers.present[from];
        result.place_px[2 * to] = markers.place_px[2 * from];
        result.place_px[2 * to + 1] = markers.place_px[2 * from + 1];
      }
    }
  }
  return result;
}

}  // namespace

RestMarkers counted(const sensor::Sensor& sensor, RestMarkers markers) {
  constexpr int kFarthest = 4;         // columns and rows
  constexpr double kMostBeyond = 0.2;  // share of the markers that may lie beyond the grid
  if (!sensor.body) return markers;
  const int fewest = static_cast<int>((1.0 - kMostBeyond) * markers.count());
  const auto fitted = [&sensor](const RestMarkers& labelled) {
    const auto start = solvePose(sensor, labelled);
    if (!start) return Geometry{};
    return tractiond::calibrate::fitGeometryFrom(*start, sensor, labelled.place_px, labelled.present);
  };
  RestMarkers best = markers;
  Geometry least = fitted(markers);
  for (int rows = -kFarthest; rows <= kFarthest; ++rows) {
    for (int columns = -kFarthest; columns <= kFarthest; ++columns) {
      RestMarkers other = moved(sensor, markers, columns, rows);
      if (other.count() < fewest) continue;
      const Geometry found = fitted(other);
      if (!isBetter(found, least)) continue;
      least = found;
      best = std::move(other);
    }
  }
  return best;
}

std::optional<tractiond::calibrate::AspectSeen> otherAspect(const sensor::Sensor& sensor, const RestMarkers& markers) {
  // With an aspect that is far off, solvePose() may find no pose. The factors are typical of interlaced fields, films
  // and squeezed pictures.
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
