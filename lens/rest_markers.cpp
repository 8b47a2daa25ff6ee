#include "lens/rest_markers.h"

#include "daemon/track/diagnosis.h"
#include "daemon/track/nominal.h"
#include "daemon/track/spot_search.h"
#include "daemon/track/tracker.h"
#include "lens/commands.h"
#include "lens/dot_match.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <utility>

namespace lens {

namespace {

using namespace tractiond;

constexpr int kZeroFrames = 4;  // the same picture, this many times
constexpr int kPatience = 100;  // frames: the tracker pauses between searches of the whole picture
constexpr double kMost = 0.9;   // share of the markers, at which no other start is tried

tl::unexpected<Error> refuse(std::string what, std::string remedy) {
  return tl::unexpected(fault("", std::move(what), std::move(remedy)));
}

/// Returns a camera from which the layer's grid has the place, direction and spacing that the picture shows, with the
/// sensor's lens and no tilt. Of the four directions of a square grid it is the one next to the file's.
sensor::Camera facing(const sensor::Sensor& sensor, std::size_t index, const track::SeenGrid& grid) {
  const sensor::MarkerLayer& layer = sensor.layers[index];
  sensor::Camera camera = sensor.camera;
  const double roll = grid.roll_rad + M_PI_2 * std::round((camera.rotation.z() - grid.roll_rad) / M_PI_2);
  const double seenDistance = camera.focal_px * layer.pitch / grid.spacing_px;
  const double apparentDepth =
      camera.windowThickness / camera.windowIndex + (sensor.gel.size.z() - layer.depth) / camera.gelIndex;
  const double surface = sensor.gel.size.z() + camera.windowThickness;
  camera.position.z() = surface + std::max(seenDistance - apparentDepth, 1e-3);
  camera.rotation = {0.0, 0.0, roll};
  const Eigen::Vector2d fromAxis = seenDistance / camera.focal_px *
                                   (Eigen::Vector2d(grid.middle_px.u, grid.middle_px.v) - camera.principal_px)
                                       .cwiseQuotient(Eigen::Vector2d(1.0, camera.aspect));
  const Eigen::Vector2d straight = Eigen::Rotation2Dd(-roll) * fromAxis;
  camera.position.head<2>() = layer.centre - Eigen::Vector2d(straight.x(), -straight.y());
  return camera;
}

/// What the tracker found from one start.
struct Search {
  RestMarkers markers;  ///< empty: too few
  MarkerSight sight;
};

Search track(const Frame& still, const sensor::Sensor& start) {
  track::TrackOptions options;
  options.zeroFrames = kZeroFrames;
  options.minValidFraction = 0.3;
  track::Tracker tracker(start, options);
  MarkerField field;
  field.resize(start.markerCount());
  RestPose rest;
  Frame frame = still;
  Search search;
  bool found = false;
  for (int i = 0; i < kPatience && !found; ++i) {
    frame.info.frameNumber = frame.info.cameraFrameId = static_cast<std::uint64_t>(i + 1);
    tracker.track(frame, field);
    found = tracker.takeRestPose(rest);
  }
  tracker.takeSight(search.sight);
  if (!found) return search;
  search.markers = {rest.position_px, rest.present, {}};
  const std::vector<track::Lattice> lattices = track::latticesOf(start);
  for (std::size_t i = 0; i < lattices.size(); ++i) {
    search.markers.seen.push_back(track::extentWith(search.sight.layers[i].seen, lattices[i], rest.present));
  }
  return search;
}

/// Returns what speaks against searching the picture for this gel, whatever its pose.
tl::expected<void, Error> searchable(const sensor::Sensor& start, PixelFormat format) {
  const sensor::Projection project(start.camera, start.gel.size.z());
  const sensor::Points markers = sensor::markerPositions(start);
  if (!std::ranges::all_of(markers.colwise(), [&](const auto& marker) { return project(marker).allFinite(); })) {
    return refuse("would be of a camera that curved surfaces hide markers from", "check [[camera.surfaces]]");
  }
  if (auto able = track::trackable(start); !able) return able;
  return track::trackable(start, format);
}

}  // namespace

int RestMarkers::count() const {
  return static_cast<int>(std::ranges::count(present, 1));
}

tl::expected<RestMarkers, Error> findMarkers(const cv::Mat& picture, const sensor::Sensor& sensor) {
  assert(picture.cols == sensor.camera.width && picture.rows == sensor.camera.height);
  const bool isGrey = picture.channels() == 1;
  const cv::Mat whole = picture.isContinuous() ? picture : picture.clone();
  Frame frame;
  frame.data = whole.data;
  frame.width = whole.cols;
  frame.height = whole.rows;
  frame.stride = (isGrey ? 1 : 3) * whole.cols;
  frame.size = static_cast<std::size_t>(frame.stride) * static_cast<std::size_t>(frame.height);
  frame.format = isGrey ? PixelFormat::kMono8 : PixelFormat::kBgr8;

  // The pose of the file is tried first: it says where the grid's rims are if the picture does not show them.
  auto able = searchable(sensor, frame.format);
  Search best;
  if (able) best = track(frame, sensor);
  if (best.markers.count() >= kMost * sensor.markerCount()) return std::move(best.markers);
  // Then those poses from which the grids look as they do.
  sensor::Sensor start = sensor;
  const PlainPicture plain = plainPicture(frame);
  std::optional<track::SeenGrid> grid;
  for (std::size_t i = 0; i < sensor.layers.size(); ++i) {
    const auto seen = track::seenGrid(sensor, i, plain);
    if (!seen || (grid && seen->spots <= grid->spots)) continue;
    grid = seen;
    start.camera = facing(sensor, i, *seen);
  }
  // Dots without a grid have their places in the picture alone.
  const auto dots = grid ? std::nullopt : matchDots(sensor, plain);
  if (dots) start.camera = *dots;
  if (grid || dots) {
    able = searchable(start, frame.format);
    if (able) {
      Search search = track(frame, start);
      if (search.markers.count() >= best.markers.count()) best = std::move(search);
    }
  }
  if (best.markers.count() > 0) return std::move(best.markers);
  if (!able) {
    return refuse((grid || dots
                       ? "cannot be searched: "
                       : "shows no grid of spots, and cannot be searched where the gel file has the camera: ") +
                      able.error().what,
                  able.error().remedy);
  }
  return refuse("shows too few markers of this gel in their order: " + track::diagnose(start, best.sight, plain),
                "is it this gel, sharp, untouched, lit in the markers' colours?");
}

}  // namespace lens
