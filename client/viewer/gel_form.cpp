#include "client/viewer/gel_form.h"

#include "traction/error.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <string>

namespace traction::view {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostLayers = 4;
constexpr double kNominalFocal = 0.02;  // relative deviation of a focal length that a data sheet states

struct Range {
  double low, high;
};

/// Returns a number of the form.
double number(const Json& form, const char* name, const Range& range, const std::string& of = "") {
  const auto found = form.find(name);
  const double value = found != form.end() && found->is_number() ? found->get<double>() : NAN;
  if (value >= range.low && value <= range.high) return value;
  char limits[80];
  std::snprintf(limits, sizeof limits, " is to be a number from %g to %g", range.low, range.high);
  throw Error(ErrorCode::kRefused, of + name + limits);
}

int whole(const Json& form, const char* name, const Range& range, const std::string& of = "") {
  return static_cast<int>(std::lround(number(form, name, range, of)));
}

std::string word(const Json& form, const char* name) {
  const auto found = form.find(name);
  return found != form.end() && found->is_string() ? found->get<std::string>() : std::string();
}

sensor::Colour colourOf(const std::string& name) {
  if (name == "blue") return sensor::Colour::kBlue;
  if (name == "red") return sensor::Colour::kRed;
  if (name == "green") return sensor::Colour::kGreen;
  if (name == "grey") return sensor::Colour::kGrey;
  throw Error(ErrorCode::kRefused, "the colour of a layer is blue, red, green or grey");
}

sensor::MarkerLayer layerOf(const Json& form, const std::string& of) {
  sensor::MarkerLayer layer;
  layer.colour = colourOf(word(form, "colour"));
  layer.darker = word(form, "contrast") == "darker";
  layer.columns = whole(form, "columns", {4, 200}, of);
  layer.rows = whole(form, "rows", {4, 200}, of);
  layer.pitch = 1e-3 * number(form, "pitch_mm", {0.1, 50}, of);
  layer.depth = 1e-3 * number(form, "depth_mm", {0.05, 200}, of);
  layer.diameter = 1e-3 * number(form, "diameter_mm", {0.02, 20}, of);
  layer.centre = 1e-3 * Eigen::Vector2d(number(form, "x_mm", {-500, 500}, of), number(form, "y_mm", {-500, 500}, of));
  return layer;
}

}  // namespace

sensor::Sensor sensorOf(const Json& form, sensor::Sensor from, bool isMeasured) {
  sensor::Sensor sensor = std::move(from);
  sensor.calibration.reset();
  sensor.creep.clear();
  sensor.gel.size = 1e-3 * Eigen::Vector3d(number(form, "width_mm", {1, 1000}), number(form, "height_mm", {1, 1000}),
                                           number(form, "thickness_mm", {0.5, 500}));
  sensor.gel.youngsModulus = 1e3 * number(form, "youngs_modulus_kpa", {1, 100'000});
  sensor.gel.poissonRatio = number(form, "poisson_ratio", {0.0, 0.4999});

  const auto layers = form.find("layers");
  if (layers == form.end() || !layers->is_array() || layers->empty() || layers->size() > kMostLayers) {
    throw Error(ErrorCode::kRefused, "a gel has one to four layers of markers");
  }
  sensor.layers.clear();
  for (const Json& layer : *layers) {
    sensor.layers.push_back(layerOf(layer, "layer " + std::to_string(sensor.layers.size() + 1) + ": "));
  }
  const sensor::MarkerLayer& first = sensor.layers.front();
  sensor.nodes = {.columns = first.columns, .rows = first.rows, .pitch = first.pitch, .centre = first.centre};

  sensor::Camera& camera = sensor.camera;
  camera.gelIndex = number(form, "gel_index", {1, 2});
  const std::string window = word(form, "window");
  camera.windowIndex = window == "acrylic" ? 1.49 : window == "glass" ? 1.52 : 1.0;
  camera.windowThickness = camera.windowIndex > 1.0 ? 1e-3 * number(form, "window_mm", {0, 200}) : 0.0;
  camera.position = {0.0, 0.0, 1e-3 * number(form, "distance_mm", {5, 5000})};
  camera.rotation.setZero();
  if (!isMeasured) {
    camera.width = whole(form, "width_px", {16, 20'000});
    camera.height = whole(form, "height_px", {16, 20'000});
    camera.focal_px = number(form, "lens_mm", {0.5, 1000}) / (1e-3 * number(form, "pixel_um", {0.3, 50}));
    camera.principal_px = {0.5 * (camera.width - 1), 0.5 * (camera.height - 1)};
    sensor.uncertainty.focal = kNominalFocal;
  }
  // The weights replace the modulus; the pose is measured next.
  sensor.uncertainty.youngsModulus = 0.5;
  if (sensor.creep.empty()) {  // usual of silicone, until it is measured (docs/calibration.md)
    for (const double time_s : {2.0, 20.0}) {
      sensor.creep.push_back({.share = 0.015, .time_s = time_s, .deviation = 0.01, .correlation = {}});
    }
  }
  sensor.uncertainty.markerDepth = 1e-3 * number(form, "marker_depth_mm", {0, 10});
  sensor.uncertainty.markerPlace = 1e-3 * number(form, "marker_place_mm", {0, 10});
  return sensor;
}

}  // namespace traction::view
