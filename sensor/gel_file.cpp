#include "sensor/gel_file.h"

#include "sensor/influence_file.h"

#include <Eigen/Eigenvalues>

#include <array>
#include <cstdio>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <utility>

namespace sensor {

namespace {

using tractiond::quoted;

constexpr int kVersion = 1;
constexpr double kMillimetres = 1e3;  // per metre

void require(TomlTable& table, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (!table.has(key)) table.fail(key, "is missing");
  }
}

/// Rejects keys whose values the influence file supplies.
void refuse(TomlTable& table, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (table.has(key)) table.fail(key, "does not go with gel.influence_file, which says it");
  }
}

void readGrid(TomlTable& table, bool body, int& columns, int& rows, double& pitch, Eigen::Vector2d& centre) {
  table.read("columns", columns, {1, 1000});
  table.read("rows", rows, {1, 1000});
  if (body) return refuse(table, {"pitch_mm", "centre_mm"});
  table.read("pitch_mm", pitch, {0.01, 1000, kMillimetres});
  table.read("centre_mm", std::span(centre.data(), 2), {-1000, 1000, kMillimetres});
}

/// Returns half the extent of a grid, from its first to its last point [m].
Eigen::Vector2d halfExtent(int columns, int rows, double pitch) {
  return 0.5 * pitch * Eigen::Vector2d(columns - 1, rows - 1);
}

/// Of a part that does not fit the gel: the key at fault and the reason.
using Misfit = std::pair<const char*, const char*>;

bool reachesOutside(const Gel& gel, const Eigen::Vector2d& centre, const Eigen::Vector2d& half) {
  return ((centre.cwiseAbs() + half - 0.5 * gel.size.head<2>()).array() > 1e-9).any();
}

std::optional<Misfit> misfit(const MarkerLayer& layer, const Gel& gel) {
  const double radius = 0.5 * layer.diameter;
  if (layer.depth - radius < 0.0 || layer.depth + radius > gel.size.z()) {
    return Misfit{"depth_mm", "places markers outside the gel"};
  }
  if (layer.diameter >= layer.pitch) return Misfit{"diameter_mm", "is not below the pitch: the markers touch"};
  if (reachesOutside(gel, layer.centre, halfExtent(layer.columns, layer.rows, layer.pitch).array() + radius)) {
    return Misfit{"pitch_mm", "and the counts place markers outside the gel"};
  }
  return std::nullopt;
}

std::optional<Misfit> misfit(const NodeGrid& nodes, const Gel& gel) {
  if (!reachesOutside(gel, nodes.centre, halfExtent(nodes.columns, nodes.rows, nodes.pitch))) return std::nullopt;
  return Misfit{"pitch_mm", "and the counts place force nodes outside the gel"};
}

std::optional<Misfit> misfit(const Camera& camera, const Gel& gel) {
  if (isBehindWindow(camera, gel.size.z())) return std::nullopt;
  return Misfit{"position_mm", "is not behind the gel and its window"};
}

/// Adds a fault if a part does not fit the gel: at the key that was read, or at the missing table if the paper's values
/// were used.
template <typename Part>
void check(const Part& part, const Gel& gel, TomlTable& root, const char* name, TomlTable* table) {
  const std::optional<Misfit> found = misfit(part, gel);
  if (!found) return;
  if (table) return table->fail(found->first, found->second);
  root.fail(name, "is missing, and the paper's " + std::string(found->first) + " " + found->second);
}

void readMaterial(TomlTable& table, bool body, Gel& gel) {
  table.read("youngs_modulus_pa", gel.youngsModulus, {1.0, 1e12});
  table.read("thickness_mm", gel.size.z(), {0.1, 1e4, kMillimetres});
  if (body) return refuse(table, {"poisson_ratio", "width_mm", "height_mm"});
  table.read("poisson_ratio", gel.poissonRatio, {0.0, 1.0});
  if (gel.poissonRatio >= 0.5) table.fail("poisson_ratio", "must be below 0.5: 0.5 is incompressible");
  table.read("width_mm", gel.size.x(), {0.1, 1e4, kMillimetres});
  table.read("height_mm", gel.size.y(), {0.1, 1e4, kMillimetres});
}

void readColour(TomlTable& table, Colour& colour) {
  std::string name = nameOf(colour), known;
  table.read("colour", name);
  for (const Colour each : {Colour::kBlue, Colour::kRed, Colour::kGreen, Colour::kGrey}) {
    known += (known.empty() ? "" : ", ") + quoted(nameOf(each));
    if (name == nameOf(each)) {
      colour = each;
      return;
    }
  }
  table.fail("colour", "must be one of " + known);
}

MarkerLayer readLayer(TomlTable& table, bool body) {
  MarkerLayer layer;
  require(table, {"colour"});
  readColour(table, layer.colour);
  std::string contrast = "brighter";
  table.read("contrast", contrast);
  layer.darker = contrast == "darker";
  if (!layer.darker && contrast != "brighter") table.fail("contrast", R"(must be one of "brighter", "darker")");
  readGrid(table, body, layer.columns, layer.rows, layer.pitch, layer.centre);
  table.read("diameter_mm", layer.diameter, {0.01, 1000, kMillimetres});
  if (body) {
    refuse(table, {"depth_mm"});
  } else {
    require(table, {"depth_mm"});
    table.read("depth_mm", layer.depth, {0.0, 1e4, kMillimetres});
  }
  return layer;
}

std::vector<RefractingSurface> readSurfaces(std::vector<TomlTable> tables) {
  std::vector<RefractingSurface> surfaces;
  const auto lowest = [](const RefractingSurface& surface) { return surface.centre.z() - surface.radii.z(); };
  for (TomlTable& table : tables) {
    RefractingSurface surface;
    require(table, {"centre_mm", "index"});
    table.read("centre_mm", std::span(surface.centre.data(), 3), {-1e4, 1e4, kMillimetres});
    table.read("radii_mm", std::span(surface.radii.data(), 3), {0.01, 1e4, kMillimetres});
    table.read("index", surface.index, {1.0, 3.0});
    if (!surfaces.empty() && lowest(surface) <= lowest(surfaces.back()))
      table.fail("centre_mm",
                 "places it before the surface that is written before it: write them from the gel to the camera");
    surfaces.push_back(surface);
    if (surfaces.size() == tables.size() && surface.index != 1.0)
      table.fail("index", "of the last surface must be 1: the camera is in air");
  }
  return surfaces;
}

void readCamera(TomlTable& table, Camera& camera) {
  table.read("width_px", camera.width, {8, 16384});
  table.read("height_px", camera.height, {8, 16384});
  table.read("focal_px", camera.focal_px, {1.0, 1e6});
  table.read("aspect", camera.aspect, {0.5, 2.0});
  table.read("principal_px", std::span(camera.principal_px.data(), 2), {-1e5, 1e5});
  table.read("k1", camera.k1, {-10, 10});
  table.read("k2", camera.k2, {-10, 10});
  table.read("position_mm", std::span(camera.position.data(), 3), {-1e4, 1e4, kMillimetres});
  table.read("rotation_rad", std::span(camera.rotation.data(), 3), {-3.2, 3.2});
  table.read("gel_index", camera.gelIndex, {1.0, 3.0});
  table.read("window_index", camera.windowIndex, {1.0, 3.0});
  table.read("window_thickness_mm", camera.windowThickness, {0.0, 1000, kMillimetres});
  camera.surfaces = readSurfaces(table.tables("surfaces"));
  for (const char* key : {"window_index", "window_thickness_mm"}) {
    if (!camera.surfaces.empty() && table.has(key))
      table.fail(key, "does not go with camera.surfaces: write a plane there");
  }
}

void readUncertainty(TomlTable& table, bool body, Uncertainty& uncertainty) {
  table.read("youngs_modulus_relative", uncertainty.youngsModulus, {0.0, 1.0});
  if (body) {
    refuse(table, {"poisson_ratio", "thickness_mm", "layer_depth_mm", "marker_depth_mm", "marker_place_mm"});
  } else {
    table.read("poisson_ratio", uncertainty.poissonRatio, {0.0, 0.5});
    table.read("thickness_mm", uncertainty.thickness, {0.0, 1000, kMillimetres});
    table.read("layer_depth_mm", uncertainty.layerDepth, {0.0, 1000, kMillimetres});
    table.read("marker_depth_mm", uncertainty.markerDepth, {0.0, 1000, kMillimetres});
    table.read("marker_place_mm", uncertainty.markerPlace, {0.0, 1000, kMillimetres});
  }
  table.read("model_relative", uncertainty.model, {0.0, 1.0});
  table.read("focal_relative", uncertainty.focal, {0.0, 1.0});
  table.read("position_mm", std::span(uncertainty.position.data(), 3), {0.0, 1000, kMillimetres});
  table.read("rotation_rad", std::span(uncertainty.rotation.data(), 3), {0.0, 1.0});
  table.read("focal_distance_correlation", uncertainty.focalDistance, {-1.0, 1.0});
  table.read("principal_px", uncertainty.principal_px, {0.0, 1e3});
  table.read("k1", uncertainty.k1, {0.0, 10.0});
  table.read("k2", uncertainty.k2, {0.0, 10.0});
}

void readPictureMotion(TomlTable& table, PictureMotion& motion) {
  table.read("shift_px", motion.shift_px, {0.0, 100.0});
  table.read("scale", motion.scale, {0.0, 0.1});
  table.read("roll_rad", motion.roll, {0.0, 0.1});
}

std::vector<CreepTerm> readCreep(std::vector<TomlTable> tables) {
  std::vector<CreepTerm> terms;
  for (TomlTable& table : tables) {
    CreepTerm& term = terms.emplace_back();
    require(table, {"share", "time_s", "deviation"});
    table.read("share", term.share, {0.0, 1.0});
    table.read("time_s", term.time_s, {1e-3, 1e6});
    table.read("deviation", term.deviation, {0.0, 1.0});
    table.read("correlation", term.correlation, {-1.0, 1.0});
    if (terms.size() > kMostCreepTerms)
      table.fail("share", "is of one term too many; at most " + std::to_string(kMostCreepTerms) + " are possible");
    if (terms.size() > 1 && term.time_s <= terms[terms.size() - 2].time_s)
      table.fail("time_s", "must be above that of the term before");
    if (!term.correlation.empty() && term.correlation.size() != terms.size() - 1)
      table.fail("correlation", "must have a number for each term before this one");
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(creepCovariance(terms), Eigen::EigenvaluesOnly);
    if (eigen.eigenvalues()[0] < -1e-9 * eigen.eigenvalues().sum())
      table.fail("correlation", "contradicts those of the terms before");
  }
  return terms;
}

Calibration readCalibration(TomlTable& table) {
  Calibration calibration;
  require(table, {"camera", "date", "hash"});
  table.read("camera", calibration.camera);
  table.read("date", calibration.date);
  table.read("geometry", calibration.geometry);
  table.read("residual_px", calibration.residual_px, {0.0, 1e3});
  table.read("noise", calibration.noise);
  table.read("noise_px", calibration.noise_px, {0.0, 1e3});
  table.read("stiffness", calibration.stiffness);
  table.read("weights_n", calibration.weights, {0.0, 1e6});
  table.read("readings_n", calibration.readings, {0.0, 1e6});
  table.read("linearity", calibration.linearity, {0.0, 1e3});
  table.read("hash", calibration.hash);
  return calibration;
}

std::string number(double value) {
  std::array<char, 40> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.15g", value);
  return buffer.data();
}

template <typename Vector>
std::string list(const Vector& values, double perUnit = 1.0) {
  std::string text = "[";
  for (const double value : values) text += (text.size() > 1 ? ", " : "") + number(value * perUnit);
  return text + "]";
}

/// Reads all tables but those of creep. \param body true: an influence file supplies the mechanics and the positions of
/// markers and nodes
Sensor readSensor(TomlTable& root, bool body) {
  Sensor sensor;
  if (auto table = root.table("gel")) readMaterial(*table, body, sensor.gel);
  std::vector<TomlTable> layers = root.tables("layers");
  if (root.has("layers")) sensor.layers.clear();
  for (TomlTable& table : layers) {
    sensor.layers.push_back(readLayer(table, body));
    if (!body) check(sensor.layers.back(), sensor.gel, root, "layers", &table);
  }
  if (layers.empty()) {
    if (root.has("layers")) root.fail("layers", "is empty: a sensor has markers");
    if (!body) {
      for (const MarkerLayer& layer : sensor.layers) check(layer, sensor.gel, root, "layers", nullptr);
    }
  }
  auto nodes = root.table("nodes");
  if (nodes) readGrid(*nodes, body, sensor.nodes.columns, sensor.nodes.rows, sensor.nodes.pitch, sensor.nodes.centre);
  if (!body) check(sensor.nodes, sensor.gel, root, "nodes", nodes ? &*nodes : nullptr);
  auto camera = root.table("camera");
  if (camera) readCamera(*camera, sensor.camera);
  check(sensor.camera, sensor.gel, root, "camera", camera ? &*camera : nullptr);
  if (auto table = root.table("uncertainty")) readUncertainty(*table, body, sensor.uncertainty);
  if (auto table = root.table("picture_motion")) readPictureMotion(*table, sensor.pictureMotion);
  if (auto table = root.table("calibration")) sensor.calibration = readCalibration(*table);
  return sensor;
}

/// Fails if curved surfaces hide a marker from the camera, or from one that is a few deviations beside its place: the
/// errors of its forces could not be stated.
tl::expected<void, FileError> checkSeen(const Sensor& sensor, const std::string& name) {
  if (sensor.camera.surfaces.empty()) return {};
  constexpr double kDeviations = 3.0;
  const Points markers = markerPositions(sensor);
  for (int side = 0; side <= 6; ++side) {
    Camera camera = sensor.camera;
    if (side > 0) {
      const int axis = (side - 1) / 2;
      camera.position[axis] += (side % 2 == 0 ? -kDeviations : kDeviations) * sensor.uncertainty.position[axis];
    }
    const Projection project(camera, sensor.gel.size.z());
    for (Eigen::Index m = 0; m < markers.cols(); ++m) {
      if (project(markers.col(m)).allFinite()) continue;
      const Eigen::Vector3d place = markers.col(m) * kMillimetres;
      std::array<char, 64> at{};
      std::snprintf(at.data(), at.size(), "(%.3g, %.3g, %.3g)", place.x(), place.y(), place.z());
      return tl::unexpected(
          FileError{.where = name,
                    .what = "camera.surfaces: no light from marker " + std::to_string(m) + " at " +
                            std::string(at.data()) + " mm reaches the camera" +
                            (side == 0 ? "" : " if it is three deviations (uncertainty.position_mm) beside its place") +
                            ": the marker is behind a surface, or seen past the half of it that is towards lower z"});
    }
  }
  return {};
}

/// Reads a gel file and its influence file; the parameters are those of parseGel().
tl::expected<Sensor, FileError> read(tl::expected<TomlTable, FileError> root, const std::string& name,
                                     const std::string& influence = {}) {
  if (!root) return tl::unexpected(root.error());
  int version = 0;
  if (!root->has("format")) root->fail("format", "is missing: a gel file starts with format = 1");
  root->read("format", version, {1, 1e6});
  if (version > kVersion) {
    root->fail("format", "= " + std::to_string(version) + " is newer than this program, which knows format = " +
                             std::to_string(kVersion) + ": update it");
  }
  std::string influenceFile;
  bool ownStiffness = false;
  if (auto table = root->table("gel")) {
    table->read("influence_file", influenceFile);
    ownStiffness = table->has("youngs_modulus_pa");
  }
  Sensor sensor = readSensor(*root, !influenceFile.empty());
  sensor.creep = readCreep(root->tables("creep"));
  if (auto done = root->finish(); !done) return tl::unexpected(done.error());
  if (!influenceFile.empty()) {
    auto body = loadBody(influence.empty() ? std::filesystem::path(name).parent_path() / influenceFile
                                           : std::filesystem::path(influence));
    if (!body) return tl::unexpected(body.error());
    if (!ownStiffness) sensor.gel.youngsModulus = body->youngsModulus;
    if (auto fits = setBody(sensor, *std::move(body)); !fits) return tl::unexpected(fits.error());
  }
  if (auto seen = checkSeen(sensor, name); !seen) return tl::unexpected(seen.error());
  return sensor;
}

}  // namespace

Sensor readGel(TomlTable& root) {
  return readSensor(root, false);
}

tl::expected<Sensor, FileError> parseGel(std::string_view text, const std::string& name, const std::string& influence) {
  return read(TomlTable::parse(text, name), name, influence);
}

tl::expected<Sensor, FileError> loadGel(const std::string& path) {
  return read(TomlTable::load(path), path);
}

namespace {

std::string line(const std::string& key, const std::string& value) {
  return key + " = " + value + "\n";
}

/// The calibration comes first, and its hash before everything else: a truncated file must not pass as an uncalibrated
/// one.
std::string calibrationText(const Calibration& made) {
  const auto mark = [](const std::string& key, const std::string& value) { return line("calibration." + key, value); };
  return mark("hash", quoted(made.hash)) + mark("camera", quoted(made.camera)) + mark("date", quoted(made.date)) +
         mark("geometry", quoted(made.geometry)) + mark("residual_px", number(made.residual_px)) +
         mark("noise", quoted(made.noise)) + mark("noise_px", number(made.noise_px)) +
         mark("stiffness", quoted(made.stiffness)) + mark("weights_n", list(made.weights)) +
         mark("readings_n", list(made.readings)) + mark("linearity", number(made.linearity)) + "\n";
}

/// Returns the sections gel, layers and nodes.
std::string bodyText(const Sensor& sensor) {
  const bool body = sensor.body != nullptr;
  const auto grid = [&](const auto& of) {
    return line("columns", std::to_string(of.columns)) + line("rows", std::to_string(of.rows)) +
           (body
                ? ""
                : line("pitch_mm", number(of.pitch * kMillimetres)) + line("centre_mm", list(of.centre, kMillimetres)));
  };
  const Gel& gel = sensor.gel;
  std::string text = "\n[gel]\n" + line("youngs_modulus_pa", number(gel.youngsModulus));
  if (body) {
    text += line("influence_file", quoted(std::filesystem::absolute(sensor.body->file)));
  } else {
    text += line("poisson_ratio", number(gel.poissonRatio)) + line("width_mm", number(gel.size.x() * kMillimetres)) +
            line("height_mm", number(gel.size.y() * kMillimetres));
  }
  text += line("thickness_mm", number(gel.size.z() * kMillimetres));
  for (const MarkerLayer& layer : sensor.layers) {
    text += "\n[[layers]]\n" + line("colour", quoted(nameOf(layer.colour))) +
            (layer.darker ? line("contrast", quoted("darker")) : "") + grid(layer) +
            (body ? "" : line("depth_mm", number(layer.depth * kMillimetres))) +
            line("diameter_mm", number(layer.diameter * kMillimetres));
  }
  return text + "\n[nodes]\n" + grid(sensor.nodes);
}

std::string cameraText(const Camera& camera) {
  std::string text = "\n[camera]\n" + line("width_px", std::to_string(camera.width)) +
                     line("height_px", std::to_string(camera.height)) + line("focal_px", number(camera.focal_px)) +
                     // It is omitted if it is 1, so that files calibrated before the key existed keep their hash.
                     (camera.aspect != 1.0 ? line("aspect", number(camera.aspect)) : "") +
                     line("principal_px", list(camera.principal_px)) + line("k1", number(camera.k1)) +
                     line("k2", number(camera.k2)) + line("position_mm", list(camera.position, kMillimetres)) +
                     line("rotation_rad", list(camera.rotation)) + line("gel_index", number(camera.gelIndex));
  if (camera.surfaces.empty()) {
    text += line("window_index", number(camera.windowIndex)) +
            line("window_thickness_mm", number(camera.windowThickness * kMillimetres));
  }
  for (const RefractingSurface& surface : camera.surfaces) {
    text += "\n[[camera.surfaces]]\n" + line("centre_mm", list(surface.centre, kMillimetres)) +
            (surface.isPlane() ? "" : line("radii_mm", list(surface.radii, kMillimetres))) +
            line("index", number(surface.index));
  }
  return text;
}

/// Omits values that are as before their keys existed, so that files calibrated then keep their hash.
std::string uncertaintyText(const Uncertainty& uncertainty, bool body) {
  std::string text = "\n[uncertainty]\n" + line("youngs_modulus_relative", number(uncertainty.youngsModulus));
  if (!body) {
    text +=
        line("poisson_ratio", number(uncertainty.poissonRatio)) +
        line("thickness_mm", number(uncertainty.thickness * kMillimetres)) +
        line("layer_depth_mm", number(uncertainty.layerDepth * kMillimetres)) +
        (uncertainty.markerDepth != 0.0 ? line("marker_depth_mm", number(uncertainty.markerDepth * kMillimetres))
                                        : "") +
        (uncertainty.markerPlace != 0.0 ? line("marker_place_mm", number(uncertainty.markerPlace * kMillimetres)) : "");
  }
  text += line("model_relative", number(uncertainty.model)) + line("focal_relative", number(uncertainty.focal)) +
          line("position_mm", list(uncertainty.position, kMillimetres)) +
          line("rotation_rad", list(uncertainty.rotation)) +
          line("focal_distance_correlation", number(uncertainty.focalDistance));
  const Uncertainty unmeasured;  // of a lens that was not measured
  if (uncertainty.principal_px != unmeasured.principal_px) {
    text += line("principal_px", number(uncertainty.principal_px));
  }
  if (uncertainty.k1 != unmeasured.k1) text += line("k1", number(uncertainty.k1));
  if (uncertainty.k2 != unmeasured.k2) text += line("k2", number(uncertainty.k2));
  return text;
}

std::string creepText(const std::vector<CreepTerm>& terms) {
  std::string text;
  for (const CreepTerm& term : terms) {
    text += "\n[[creep]]\n" + line("share", number(term.share)) + line("time_s", number(term.time_s)) +
            line("deviation", number(term.deviation)) +
            (term.correlation.empty() ? "" : line("correlation", list(term.correlation)));
  }
  return text;
}

}  // namespace

std::string gelText(const Sensor& sensor) {
  const PictureMotion& motion = sensor.pictureMotion;
  return (sensor.calibration ? calibrationText(*sensor.calibration) : "") + line("format", std::to_string(kVersion)) +
         bodyText(sensor) + cameraText(sensor.camera) + uncertaintyText(sensor.uncertainty, sensor.body != nullptr) +
         "\n[picture_motion]\n" + line("shift_px", number(motion.shift_px)) + line("scale", number(motion.scale)) +
         line("roll_rad", number(motion.roll)) + creepText(sensor.creep);
}

}  // namespace sensor
