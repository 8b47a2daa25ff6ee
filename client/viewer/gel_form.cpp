#include "client/viewer/gel_form.h"

#include "client/show/page.h"
#include "traction/error.h"

#include <nlohmann/json.hpp>

#include <cmath>
#include <string>

namespace traction::view {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostLayers = 4;
constexpr double kNominalFocal = 0.02;  // relative deviation of a focal length that a data sheet states

sensor::Colour colourOf(const std::string& name) {
  using sensor::Colour;
  for (const Colour colour : {Colour::kBlue, Colour::kRed, Colour::kGreen, Colour::kGrey}) {
    if (name == nameOf(colour)) return colour;
  }
  throw Error(ErrorCode::kRefused, "the colour of a layer is blue, red, green or grey");
}

sensor::MarkerLayer layerOf(const Json& form, const std::string& of) {
  const auto number = [&](const char* name, double low, double high) {
    return numberIn(form, name, low, high, {}, of);
  };
  sensor::MarkerLayer layer;
  layer.colour = colourOf(textIn(form, "colour"));
  layer.darker = textIn(form, "contrast") == "darker";
  layer.columns = static_cast<int>(std::lround(number("columns", 4, 200)));
  layer.rows = static_cast<int>(std::lround(number("rows", 4, 200)));
  layer.pitch = 1e-3 * number("pitch_mm", 0.1, 50);
  layer.depth = 1e-3 * number("depth_mm", 0.05, 200);
  layer.diameter = 1e-3 * number("diameter_mm", 0.02, 20);
  layer.centre = 1e-3 * Eigen::Vector2d(number("x_mm", -500, 500), number("y_mm", -500, 500));
  return layer;
}

}  // namespace

double numberIn(const Json& from, const char* name, double low, double high, std::optional<double> otherwise,
                const std::string& of) {
  const auto found = from.find(name);
  if (found == from.end() && otherwise) return *otherwise;
  const double value = found != from.end() && found->is_number() ? found->get<double>() : NAN;
  if (value >= low && value <= high) return value;
  throw Error(ErrorCode::kRefused, of + client::format("%s is to be a number from %g to %g", name, low, high));
}

std::string textIn(const Json& from, const char* name) {
  const auto found = from.find(name);
  if (found == from.end() || !found->is_string()) return {};
  auto value = found->get<std::string>();
  if (value.size() > 64) throw Error(ErrorCode::kRefused, std::string(name) + " is too long");
  return value;
}

sensor::Sensor sensorOf(const Json& form, sensor::Sensor from, bool isMeasured) {
  const auto number = [&](const char* name, double low, double high) { return numberIn(form, name, low, high); };
  sensor::Sensor sensor = std::move(from);
  sensor.calibration.reset();
  sensor.creep.clear();
  sensor.gel.size = 1e-3 * Eigen::Vector3d(number("width_mm", 1, 1000), number("height_mm", 1, 1000),
                                           number("thickness_mm", 0.5, 500));
  sensor.gel.youngsModulus = 1e3 * number("youngs_modulus_kpa", 1, 100'000);
  sensor.gel.poissonRatio = number("poisson_ratio", 0.0, 0.4999);

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
  camera.gelIndex = number("gel_index", 1, 2);
  const std::string window = textIn(form, "window");
  camera.windowIndex = window == "acrylic" ? 1.49 : window == "glass" ? 1.52 : 1.0;
  camera.windowThickness = camera.windowIndex > 1.0 ? 1e-3 * number("window_mm", 0, 200) : 0.0;
  camera.position = {0.0, 0.0, 1e-3 * number("distance_mm", 5, 5000)};
  camera.rotation.setZero();
  if (!isMeasured) {
    camera.width = static_cast<int>(std::lround(number("width_px", 16, 20'000)));
    camera.height = static_cast<int>(std::lround(number("height_px", 16, 20'000)));
    camera.focal_px = number("lens_mm", 0.5, 1000) / (1e-3 * number("pixel_um", 0.3, 50));
    camera.principal_px = {0.5 * (camera.width - 1), 0.5 * (camera.height - 1)};
    sensor.uncertainty.focal = kNominalFocal;
  }
  // The weights replace the modulus; the pose is measured next.
  sensor.uncertainty.youngsModulus = 0.5;
  for (const double time_s : {2.0, 20.0}) {  // usual of silicone, until it is measured (docs/calibration.md)
    sensor.creep.push_back({.share = 0.015, .time_s = time_s, .deviation = 0.01, .correlation = {}});
  }
  sensor.uncertainty.markerDepth = 1e-3 * number("marker_depth_mm", 0, 10);
  sensor.uncertainty.markerPlace = 1e-3 * number("marker_place_mm", 0, 10);
  return sensor;
}

}  // namespace traction::view
