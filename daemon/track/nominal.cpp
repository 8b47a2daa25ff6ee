#include "daemon/track/nominal.h"

#include "daemon/track/marker_template.h"
#include "sensor/projection.h"

#include <Eigen/LU>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace tractiond::track {
namespace {

tl::unexpected<Error> error(std::string what, std::string remedy) {
  return tl::make_unexpected(Error{EX_CONFIG, std::move(what), "", std::move(remedy)});
}

}  // namespace

std::vector<Vector> nominalPlaces(const sensor::Sensor& sensor) {
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const sensor::Points points = sensor::markerPositions(sensor);
  std::vector<Vector> places;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector2f place = project(points.col(i)).cast<float>();
    places.push_back({place.x(), place.y()});
  }
  return places;
}

double markerRadius(const sensor::Sensor& sensor, const sensor::MarkerLayer& layer) {
  const sensor::Projection project(sensor.camera, sensor.gel.size.z());
  const Eigen::Vector3d middle(layer.centre.x(), layer.centre.y(), layer.depth);
  const Eigen::Matrix2d scale = project.jacobian(middle).leftCols<2>();
  return 0.5 * layer.diameter * std::sqrt(std::abs(scale.determinant()));
}

float smallestSpacing(std::span<const Vector> places_px, std::span<const Lattice> lattices) {
  float least = std::numeric_limits<float>::max();
  for (const Lattice& lattice : lattices) {
    const Vector across = places_px[lattice.at(lattice.columns - 1, 0)] - places_px[lattice.at(0, 0)];
    const Vector down = places_px[lattice.at(0, lattice.rows - 1)] - places_px[lattice.at(0, 0)];
    least = std::min({least, std::sqrt(across.squared()) / static_cast<float>(lattice.columns - 1),
                      std::sqrt(down.squared()) / static_cast<float>(lattice.rows - 1)});
  }
  return least;
}

tl::expected<void, Error> trackable(const sensor::Sensor& sensor) {
  if (sensor.layers.empty() || sensor.layers.size() > 2) {
    return error(std::to_string(sensor.layers.size()) + " marker layers", "one or two can be tracked");
  }
  if (sensor.layers.size() == 2 && sensor.layers[0].darker == sensor.layers[1].darker) {
    const sensor::Colour first = sensor.layers[0].colour, second = sensor.layers[1].colour;
    constexpr const char* kRemedy = "give each its own of blue, red and green, or one brighter and one darker markers";
    if (first == second) return error("two marker layers of the same colour and contrast", kRemedy);
    if (first == sensor::Colour::kGrey || second == sensor::Colour::kGrey) {
      return error(
          "two marker layers of the same contrast, one of them grey, which shows in the other's colour as well",
          kRemedy);
    }
  }
  const std::vector<Vector> places = nominalPlaces(sensor);
  for (const Lattice& lattice : latticesOf(sensor)) {
    if (lattice.columns < 4 || lattice.rows < 4) {
      return error("a marker layer of fewer than 4 x 4 markers", "give it more columns and rows");
    }
    const std::size_t index = lattice.first == 0 ? 0 : 1;
    const double radius_px = markerRadius(sensor, sensor.layers[index]);
    if (radius_px < 1.0 || radius_px > MarkerTemplate::largestRadius()) {
      const double largest_px = 2.0 * MarkerTemplate::largestRadius();
      const bool isLarge = radius_px > 1.0;
      return error(fmt::format("markers of {:.1f} px in the picture", 2.0 * radius_px),
                   fmt::format("between 2 and {:g} px can be tracked: {}", largest_px,
                               isLarge ? fmt::format("make the picture smaller, {:.2g} times or less, by the camera's "
                                                     "binning or by resizing, and width_px, height_px, focal_px and "
                                                     "principal_px in the gel file with it",
                                                     0.95 * largest_px / (2.0 * radius_px))
                                       : "bring the camera nearer, or take a longer lens or a larger picture"));
    }
    if (smallestSpacing(places, {&lattice, 1}) < 3.5 * radius_px) {
      return error("markers closer to each other than 1.75 of their diameters", "give the layer a wider pitch");
    }
  }
  return {};
}

tl::expected<void, Error> trackable(const sensor::Sensor& sensor, PixelFormat format) {
  const bool alike = sensor.layers.size() == 2 && sensor.layers[0].darker == sensor.layers[1].darker;
  if (!alike || traitsOf(format).colours != PixelColours::kMono) return {};
  return error("the picture is grey (" + std::string(traitsOf(format).name) +
                   "), and only their colours tell the gel's two layers of markers apart",
               "choose a format with colours, or a gel with one layer, or with one of brighter and one of darker "
               "markers; to aim "
               "a camera before there is a gel file, set sensor.gel_file = \"none\"");
}

}  // namespace tractiond::track
