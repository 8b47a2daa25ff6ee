#include "daemon/track/spot_search.h"

#include "base/quantile.h"
#include "daemon/track/appearance.h"
#include "daemon/track/marker_template.h"
#include "daemon/track/plane.h"
#include "daemon/track/point_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tractiond::track {

namespace {

constexpr double kLeastRadius_px = 1.0, kRadiusStep = 1.25;
constexpr float kAlike = 0.15F;        // of the spacing: nearest neighbours that tell the direction
constexpr float kBeside = 0.25F;       // of the spacing, from where a neighbour is expected
constexpr double kFewest = 1.0 / 3.0;  // of the layer's markers

/// Returns one channel of the picture as a plane.
Plane channelOf(const PlainPicture& picture, int channel) {
  Plane plane;
  plane.first = picture.levels.data() + channel;
  plane.stride = std::ptrdiff_t{picture.channels} * picture.width;
  plane.step = picture.channels;
  plane.width = picture.width;
  plane.height = picture.height;
  return plane;
}

/// Returns the vector from each spot to the nearest other one.
std::vector<Vector> toNearest(std::span<const Spot> spots) {
  std::vector<Vector> nearest;
  nearest.reserve(spots.size());
  for (const Spot& spot : spots) {
    Vector least;
    float least2 = std::numeric_limits<float>::max();
    for (const Spot& other : spots) {
      const Vector to{other.u - spot.u, other.v - spot.v};
      if (&other == &spot || to.squared() >= least2) continue;
      least2 = to.squared();
      least = to;
    }
    nearest.push_back(least);
  }
  return nearest;
}

float medianLength(const std::vector<Vector>& vectors) {
  std::vector<float> squares;
  for (const Vector& vector : vectors) squares.push_back(vector.squared());
  return std::sqrt(quantile(squares));
}

/// Returns the grid that most of the spots form.
SeenGrid gridOf(std::span<const Spot> spots, const PlainPicture& picture) {
  SeenGrid grid;
  if (spots.size() < 10) return grid;
  const std::vector<Vector> nearest = toNearest(spots);
  grid.spacing_px = medianLength(nearest);
  // The sides of a square grid are the same direction four times around.
  float along = 0.0F, across = 0.0F;
  for (const Vector& to : nearest) {
    if (std::abs(std::sqrt(to.squared()) / grid.spacing_px - 1.0F) > kAlike) continue;
    const float angle = 4.0F * std::atan2(to.v, to.u);
    along += std::cos(angle);
    across += std::sin(angle);
  }
  grid.roll_rad = 0.25F * std::atan2(across, along);

  PointGrid places(picture.width, picture.height, std::max(2.0F, grid.spacing_px), static_cast<int>(spots.size()));
  for (std::size_t i = 0; i < spots.size(); ++i) places.add(static_cast<int>(i), spots[i].u, spots[i].v);
  const Vector side = grid.spacing_px * Vector{std::cos(grid.roll_rad), std::sin(grid.roll_rad)};
  const float reach = kBeside * grid.spacing_px;
  for (const Spot& spot : spots) {
    int neighbours = 0;
    for (const Vector& to : {side, Vector{-side.v, side.u}, -1.0F * side, Vector{side.v, -side.u}}) {
      bool found = false;
      const Vector at = Vector{spot.u, spot.v} + to;
      places.near(at.u, at.v, reach, [&](int i) {
        const Spot& other = spots[static_cast<std::size_t>(i)];
        found = found || (Vector{other.u, other.v} - at).squared() < reach * reach;
      });
      neighbours += found ? 1 : 0;
    }
    if (neighbours < 3) continue;
    ++grid.spots;
    grid.middle_px = grid.middle_px + Vector{spot.u, spot.v};
  }
  if (grid.spots > 0) grid.middle_px = (1.0F / static_cast<float>(grid.spots)) * grid.middle_px;
  return grid;
}

}  // namespace

LayerChannels channelsOf(const sensor::MarkerLayer& layer, const PlainPicture& picture) {
  if (picture.channels == 1) return {0, -1};
  switch (layer.colour) {
  case sensor::Colour::kRed:
    return {0, 2};
  case sensor::Colour::kBlue:
    return {2, 0};
  default:
    return {1, -1};
  }
}

SpotSearch::SpotSearch(int markers, const PlainPicture& picture)
    : picture_(picture)
    , detector_(picture.width, picture.height, markers) {}

std::span<const Spot> SpotSearch::spots(LayerChannels channels, double radius_px, bool dark) {
  Plane own = channelOf(picture_, channels.own), beside;
  if (channels.other >= 0) beside = channelOf(picture_, channels.other);
  own.sign = beside.sign = dark ? -1.0F : 1.0F;
  return detector_.find(own, beside, roughTemplate(own, radius_px));
}

std::optional<float> spacingOf(std::span<const Spot> spots) {
  if (spots.size() < 10) return std::nullopt;
  return medianLength(toNearest(spots));
}

std::optional<SeenGrid> seenGrid(const sensor::Sensor& sensor, std::size_t index, const PlainPicture& picture) {
  const sensor::MarkerLayer& layer = sensor.layers[index];
  SpotSearch search(layer.count(), picture);
  const LayerChannels channels = channelsOf(layer, picture);
  const auto aspect = static_cast<float>(sensor.camera.aspect);
  SeenGrid best;
  for (double radius_px = kLeastRadius_px; radius_px <= MarkerTemplate::largestRadius(); radius_px *= kRadiusStep) {
    const std::span<const Spot> found = search.spots(channels, radius_px, layer.darker);
    std::vector<Spot> square(found.begin(), found.end());  // as pixels that are square show them
    for (Spot& spot : square) spot.v /= aspect;
    SeenGrid grid = gridOf(square, picture);
    grid.middle_px.v *= aspect;
    if (grid.spots > best.spots) best = grid;
  }
  if (best.spots < kFewest * layer.count()) return std::nullopt;
  return best;
}

}  // namespace tractiond::track
