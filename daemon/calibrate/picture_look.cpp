// A regular pattern has few looks, so all are tried. Mirrored or turned ones often agree both: which of them it is, a
// person must see. A mirrored picture is never mended by the gel file: any file that fits it has mirrored forces.
#include "daemon/calibrate/picture_look.h"

#include <Eigen/Geometry>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace tractiond::calibrate {

namespace {

constexpr double kAlarm = 5.0;    // deviations
constexpr double kSame = 0.1e-3;  // deviation with which a picture tells two places apart [m]

struct Look {
  bool exchanged = false;  ///< the colours of the two layers
  bool mirrored = false;   ///< left to right, before it is turned
  int quarters = 0;        ///< by which the gel is turned in the picture, anticlockwise

  Eigen::Matrix2d change() const {
    const Eigen::Vector2d side(mirrored ? -1.0 : 1.0, 1.0);
    return Eigen::Rotation2Dd(quarters * M_PI_2).toRotationMatrix() * side.asDiagonal();
  }
};

bool agrees(const Look& look, const sensor::Sensor& file, std::span<const LatticeSeen> seen,
            const BetweenLayers& between) {
  const std::vector<sensor::MarkerLayer>& layers = file.layers;
  if (look.exchanged && (layers.size() < 2 || layers[0].pitch != layers[1].pitch)) return false;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const sensor::MarkerLayer& layer = layers[look.exchanged ? layers.size() - 1 - i : i];
    const bool across = look.quarters % 2 != 0;
    if (seen[i].columns != (across ? layer.rows : layer.columns)) return false;
    if (seen[i].rows != (across ? layer.columns : layer.rows)) return false;
  }
  if (layers.size() < 2) return true;
  const Eigen::Vector2d offset = (look.exchanged ? -1.0 : 1.0) * (layers[1].centre - layers[0].centre);
  Eigen::Vector3d expected;
  expected << look.change() * offset, (look.exchanged ? -1.0 : 1.0) * (layers[1].depth - layers[0].depth);
  // Where the places are the file's, its depths alone are exchanged.
  if (look.exchanged && (expected.head<2>() + offset).norm() < kSame) return false;
  return ((between.difference - expected).array().abs() <= kAlarm * between.deviation.array()).all();
}

std::vector<Look> looks(const sensor::Sensor& file, std::span<const LatticeSeen> seen, const BetweenLayers& between) {
  std::vector<Look> found;
  for (const bool exchanged : {false, true}) {
    for (const bool mirrored : {false, true}) {
      for (const int quarters : {0, 1, 2, 3}) {
        const Look look{exchanged, mirrored, quarters};
        if (agrees(look, file, seen, between)) found.push_back(look);
      }
    }
    if (!found.empty()) break;
  }
  return found;
}

}  // namespace

std::string otherLook(const sensor::Sensor& file, std::span<const LatticeSeen> seen, const BetweenLayers& between) {
  if (file.body) return "";
  const std::vector<Look> found = looks(file, seen, between);
  if (found.empty()) return "";
  if (found.front().exchanged) {  // what else is to be mended, the next comparison says
    return "the picture shows the gel with the colours of its layers exchanged: exchange colour of the two [[layers]], "
           "or correct camera.pixel_format if red and blue of the picture are exchanged";
  }
  std::string shows, remedy;
  for (const auto& [exchanged, mirrored, quarters] : found) {
    constexpr std::array kTurned = {"", "turned by 90° anticlockwise", "turned by 180°", "turned by 90° clockwise"};
    constexpr std::array kMirrored = {"left to right", "about a diagonal", "top to bottom", "about a diagonal"};
    const auto i = static_cast<std::size_t>(quarters);
    shows += shows.empty() ? "" : " or ";
    shows += mirrored ? fmt::format("mirrored {}", kMirrored[i]) : kTurned[i];
    if (mirrored) {
      remedy +=
          fmt::format("; if tractionctl snapshot shows writing mirrored that is held before the camera, change {} in "
                      "camera.features and measure the lens again: no gel file mends that, its forces are mirrored",
                      quarters == 2 ? "ReverseY" : "ReverseX");
    } else {
      sensor::Camera camera = file.camera;
      const Eigen::AngleAxisd turn(quarters * M_PI_2, Eigen::Vector3d::UnitZ());
      sensor::setToCamera(camera, sensor::toCamera(camera) * turn);
      remedy +=
          fmt::format("; if the camera or the gel is turned, turn it back, or write rotation_rad = [{:.4f}, {:.4f}, "
                      "{:.4f}] into [camera] and measure the pose again",
                      camera.rotation.x(), camera.rotation.y(), camera.rotation.z());
    }
  }
  return fmt::format("the picture shows the gel {}: {}", shows, remedy.substr(2));
}

bool mayBeMirrored(const sensor::Sensor& sensor) {
  if (sensor.body) return true;
  std::vector<LatticeSeen> own;
  for (const sensor::MarkerLayer& layer : sensor.layers) own.push_back({layer.columns, layer.rows});
  BetweenLayers between{.difference = {}, .deviation = Eigen::Vector3d::Constant(kSame)};
  const sensor::MarkerLayer &one = sensor.layers.front(), &other = sensor.layers.back();
  between.difference << other.centre - one.centre, other.depth - one.depth;
  return std::ranges::any_of(looks(sensor, own, between), [](const Look& look) { return look.mirrored; });
}

}  // namespace tractiond::calibrate
