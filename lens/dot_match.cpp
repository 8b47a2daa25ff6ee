#include "lens/dot_match.h"

#include "daemon/track/spot_search.h"
#include "lens/first_pose.h"

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace lens {

namespace {

using namespace tractiond;

constexpr int kTurns = 5, kScales = 4;
constexpr double kTurn_rad = 0.035, kScale = 0.025;      // steps to each side
constexpr double kSideways = 0.2;                        // of the picture's width
constexpr double kNear = 1.0 / 3.0, kShift = 1.0 / 5.0;  // of the markers' distance in the picture
constexpr std::size_t kLookedAt = 150;                   // markers that are looked at for each pose
constexpr float kLeast = 0.4F;                           // mean agreement of the markers with a true pose

/// The markers of a layer where the sensor's camera has them, about its principal point, and the picture's spots.
struct Layer {
  std::vector<Eigen::Vector2d> markers_px;
  std::vector<Eigen::Vector2d> spots_px;
  cv::Mat distance_px;  ///< of each pixel from the nearest spot
  double apart_px = 0.0;
};

std::vector<Layer> layersOf(const sensor::Sensor& sensor, const PlainPicture& picture) {
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const sensor::Points points = sensor::markerPositions(sensor);
  track::SpotSearch search(sensor.markerCount(), picture);
  std::vector<Layer> layers;
  Eigen::Index marker = 0;
  for (const sensor::MarkerLayer& each : sensor.layers) {
    Layer& layer = layers.emplace_back();
    double scale = 0.0;  // [px/m]
    for (const Eigen::Index end = marker + each.count(); marker < end; ++marker) {
      layer.markers_px.emplace_back(project(points.col(marker)) - sensor.camera.principal_px);
      scale += project.jacobian(points.col(marker)).leftCols<2>().norm() / std::sqrt(2.0) / each.count();
    }
    layer.apart_px = scale * each.pitch;
    cv::Mat free(picture.height, picture.width, CV_8U, cv::Scalar(255));
    const double radius_px = std::max(1.0, 0.5 * scale * each.diameter);
    for (const track::Spot& spot : search.spots(track::channelsOf(each, picture), radius_px, each.darker)) {
      layer.spots_px.emplace_back(spot.u, spot.v);
      free.at<std::uint8_t>(static_cast<int>(std::lround(spot.v)), static_cast<int>(std::lround(spot.u))) = 0;
    }
    cv::distanceTransform(free, layer.distance_px, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  }
  return layers;
}

/// How the picture of the sensor's camera is turned, scaled and shifted.
struct Change {
  double turn_rad = 0.0, scale = 1.0;
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();
};

/// A marker in the picture before the shift, for one turn and scale.
struct Looked {
  float u, v;
  const cv::Mat* distance_px;
  float perReach;  ///< 1 over how far away counts as near
};

/// Returns some markers of each layer, evenly.
std::vector<Looked> lookedAt(const std::vector<Layer>& layers, const Eigen::Vector2d& principal_px,
                             const Change& change) {
  const Eigen::Matrix2d turned = change.scale * Eigen::Rotation2Dd(change.turn_rad).toRotationMatrix();
  std::vector<Looked> looked;
  for (const Layer& layer : layers) {
    const std::size_t stride = 1 + layer.markers_px.size() / kLookedAt;
    for (std::size_t i = 0; i < layer.markers_px.size(); i += stride) {
      const Eigen::Vector2f at = (principal_px + turned * layer.markers_px[i]).cast<float>();
      looked.push_back(
          {at.x() + 0.5F, at.y() + 0.5F, &layer.distance_px, static_cast<float>(1.0 / (kNear * layer.apart_px))});
    }
  }
  return looked;
}

/// Returns the mean over the markers of 1 on a spot, falling to 0 as far away as counts as near.
float agreement(const std::vector<Looked>& looked, float right, float down) {
  float sum = 0.0F;
  for (const Looked& each : looked) {
    const float u = each.u + right, v = each.v + down;
    if (!(u >= 0.0F && v >= 0.0F && u < static_cast<float>(each.distance_px->cols) &&
          v < static_cast<float>(each.distance_px->rows)))
      continue;
    const float away = each.distance_px->ptr<float>(static_cast<int>(v))[static_cast<int>(u)];
    sum += std::max(0.0F, 1.0F - away * each.perReach);
  }
  return sum / static_cast<float>(looked.size());
}

/// Returns the spot next to each marker as the sensor's camera has it, if it is near.
RestMarkers labelled(const sensor::Sensor& sensor, const std::vector<Layer>& layers) {
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const sensor::Points points = sensor::markerPositions(sensor);
  RestMarkers markers;
  for (const Layer& layer : layers) {
    for (std::size_t i = 0; i < layer.markers_px.size(); ++i) {
      const Eigen::Vector2d at = project(points.col(static_cast<Eigen::Index>(markers.present.size())));
      const auto away = [&](const Eigen::Vector2d& spot) { return (spot - at).squaredNorm(); };
      const auto next = std::ranges::min_element(layer.spots_px, {}, away);
      const bool isNear = next != layer.spots_px.end() && std::sqrt(away(*next)) < kNear * layer.apart_px;
      markers.present.push_back(isNear ? 1 : 0);
      for (const double coordinate : isNear ? *next : at) markers.place_px.push_back(static_cast<float>(coordinate));
    }
  }
  return markers;
}

/// Returns a camera that sees the gel's middle so.
sensor::Camera changed(const sensor::Sensor& sensor, const Change& change) {
  sensor::Camera camera = sensor.camera;
  const Eigen::Matrix3d before = sensor::toCamera(camera);
  const Eigen::Matrix3d after = Eigen::AngleAxisd(change.turn_rad, Eigen::Vector3d::UnitZ()) * before;
  const Eigen::Vector3d middle = sensor::markerPositions(sensor).rowwise().mean();
  const double distance = (before * (middle - camera.position)).z(), away = distance / change.scale;
  camera.position -= after.transpose() * Eigen::Vector3d(change.shift_px.x() * away / camera.focal_px,
                                                         change.shift_px.y() * away / (camera.aspect * camera.focal_px),
                                                         away - distance);
  sensor::setToCamera(camera, after);
  return camera;
}

}  // namespace

std::optional<sensor::Camera> matchDots(const sensor::Sensor& sensor, const PlainPicture& picture) {
  const std::vector<Layer> layers = layersOf(sensor, picture);
  const double step_px = std::max(1.0, kShift * layers.front().apart_px);
  const int shifts = static_cast<int>(kSideways * picture.width / step_px);
  Change best;
  float most = 0.0F;
  for (int turn = -kTurns; turn <= kTurns; ++turn) {
    for (int scale = -kScales; scale <= kScales; ++scale) {
      Change change{.turn_rad = turn * kTurn_rad, .scale = 1.0 + scale * kScale};
      const std::vector<Looked> looked = lookedAt(layers, sensor.camera.principal_px, change);
      for (int u = -shifts; u <= shifts; ++u) {
        for (int v = -shifts; v <= shifts; ++v) {
          change.shift_px = {u * step_px, v * step_px};
          const float found = agreement(looked, static_cast<float>(u * step_px), static_cast<float>(v * step_px));
          if (found <= most) continue;
          most = found;
          best = change;
        }
      }
    }
  }
  if (most < kLeast) return std::nullopt;
  // Tilts and what is nearer to the camera move markers against each other.
  sensor::Sensor posed = sensor;
  posed.camera = changed(sensor, best);
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    const auto camera = solvePose(posed, labelled(posed, layers));
    if (!camera) break;
    posed.camera = *camera;
  }
  return posed.camera;
}

}  // namespace lens
