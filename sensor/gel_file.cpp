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
using tractiond::Range;

constexpr int kVersion = 1;
constexpr double kMillimetres = 1e3;  // per metre

/// Writes what a TomlTable reads, so that the keys of each table are listed once for both.
class TextTable {
 public:
  /// \param text to which lines are added
  /// \param prefix of the keys
  explicit TextTable(std::string& text, std::string prefix = "")
      : text_(text)
      , prefix_(std::move(prefix)) {}

  void read(std::string_view key, const std::string& value) { line(key, quoted(value)); }
  void read(std::string_view key, double value, const Range& range) { line(key, number(value * range.perUnit)); }
  void read(std::string_view key, std::span<const double> values, const Range& range) {
    std::string list;
    for (const double value : values) list += (list.empty() ? "" : ", ") + number(value * range.perUnit);
    line(key, "[" + list + "]");
  }
  bool has(std::string_view /*key*/) const { return false; }
  void fail(std::string_view /*key*/, const std::string& /*what*/) {}

 private:
  static std::string number(double value) {
    std::array<char, 40> buffer{};
    std::snprintf(buffer.data(), buffer.size(), "%.15g", value);
    return buffer.data();
  }
  void line(std::string_view key, const std::string& value) {
    text_.append(prefix_).append(key).append(" = ").append(value).append("\n");
  }

  std::string& text_;
  const std::string prefix_;
};

bool writes(const TomlTable& /*table*/) {
  return false;
}
bool writes(const TextTable& /*table*/) {
  return true;
}

/// Reads or writes a number whose key did not always exist: files that were calibrated before keep their hash, as it is
/// left out where it is as `usual`.
void newer(auto& table, std::string_view key, double& value, const Range& range, double usual) {
  if (!writes(table) || value != usual) table.read(key, value, range);
}

void require(auto& table, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (!table.has(key)) table.fail(key, "is missing");
  }
}

/// Rejects keys whose values the influence file supplies.
void refuse(auto& table, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (table.has(key)) table.fail(key, "does not go with gel.influence_file, which says it");
  }
}

// What follows reads a table, or writes it. Of a body the influence file says the rest.

void grid(auto& table, bool body, auto& grid) {
  table.read("columns", grid.columns, {1, 1000});
  table.read("rows", grid.rows, {1, 1000});
  if (body) return refuse(table, {"pitch_mm", "centre_mm"});
  table.read("pitch_mm", grid.pitch, {0.01, 1000, kMillimetres});
  table.read("centre_mm", std::span(grid.centre.data(), 2), {-1000, 1000, kMillimetres});
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
  if (!isBehindWindow(camera, gel.size.z())) return Misfit{"position_mm", "is not behind the gel and its window"};
  if (foldOf(camera)) {
    return Misfit{"k1",
                  "to k4 fold the picture: theta (1 + k1 theta^2 + ... + k4 theta^8) does not rise up to its corners"};
  }
  return std::nullopt;
}

/// Adds a fault if a part does not fit the gel: at the key that was read, or at the missing table if the paper's values
/// were used.
void check(const auto& part, const Gel& gel, TomlTable& root, const char* name, TomlTable* table) {
  const std::optional<Misfit> found = misfit(part, gel);
  if (!found) return;
  if (table) return table->fail(found->first, found->second);
  root.fail(name, "is missing, and the paper's " + std::string(found->first) + " " + found->second);
}

/// Returns the nodes of a gel whose file does not state them: over the markers. They are twice as fine where the
/// markers lie so far apart that loads between them would be misplaced by what a coarse grid can hold.
NodeGrid nodesOver(const MarkerLayer& markers) {
  NodeGrid nodes{markers.columns, markers.rows, markers.pitch, markers.centre};
  if (markers.pitch <= 2.0 * markers.depth) return nodes;
  nodes.pitch *= 0.5;
  for (int* count : {&nodes.columns, &nodes.rows}) *count = 2 * *count - 1;
  return nodes;
}

void material(auto& table, bool body, Gel& gel) {
  if (body) {
    refuse(table, {"poisson_ratio", "width_mm", "height_mm"});
  } else {
    table.read("poisson_ratio", gel.poissonRatio, {0.0, 1.0});
    if (gel.poissonRatio >= 0.5) table.fail("poisson_ratio", "must be below 0.5: 0.5 is incompressible");
    table.read("width_mm", gel.size.x(), {0.1, 1e4, kMillimetres});
    table.read("height_mm", gel.size.y(), {0.1, 1e4, kMillimetres});
  }
  table.read("thickness_mm", gel.size.z(), {0.1, 1e4, kMillimetres});
}

void colour(auto& table, Colour& colour) {
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

void markers(auto& table, bool body, MarkerLayer& layer) {
  require(table, {"colour"});
  colour(table, layer.colour);
  std::string contrast = layer.darker ? "darker" : "brighter";
  if (!writes(table) || layer.darker) table.read("contrast", contrast);
  layer.darker = contrast == "darker";
  if (!layer.darker && contrast != "brighter") table.fail("contrast", R"(must be one of "brighter", "darker")");
  grid(table, body, layer);
  if (body) {
    refuse(table, {"depth_mm"});
  } else {
    require(table, {"depth_mm"});
    table.read("depth_mm", layer.depth, {0.0, 1e4, kMillimetres});
  }
  table.read("diameter_mm", layer.diameter, {0.01, 1000, kMillimetres});
}

void refraction(auto& table, RefractingSurface& surface) {
  require(table, {"centre_mm", "index"});
  table.read("centre_mm", std::span(surface.centre.data(), 3), {-1e4, 1e4, kMillimetres});
  if (!writes(table) || !surface.isPlane()) {
    table.read("radii_mm", std::span(surface.radii.data(), 3), {0.01, 1e4, kMillimetres});
  }
  table.read("index", surface.index, {1.0, 3.0});
}

constexpr std::size_t kMostSurfaces = 16;

std::vector<RefractingSurface> readSurfaces(std::vector<TomlTable> tables) {
  std::vector<RefractingSurface> surfaces;
  const auto lowest = [](const RefractingSurface& surface) { return surface.centre.z() - surface.radii.z(); };
  for (TomlTable& table : tables) {
    RefractingSurface surface;
    refraction(table, surface);
    if (!surfaces.empty() && lowest(surface) <= lowest(surfaces.back()))
      table.fail("centre_mm",
                 "places it before the surface that is written before it: write them from the gel to the camera");
    surfaces.push_back(surface);
    if (surfaces.size() > kMostSurfaces) {
      table.fail("centre_mm", "is of one surface too many; at most " + std::to_string(kMostSurfaces) + " are possible");
      break;
    }
    if (surfaces.size() == tables.size() && surface.index != 1.0)
      table.fail("index", "of the last surface must be 1: the camera is in air");
  }
  return surfaces;
}

void pinhole(auto& table, Camera& camera) {
  table.read("width_px", camera.width, {8, 16384});
  table.read("height_px", camera.height, {8, 16384});
  table.read("focal_px", camera.focal_px, {1.0, 1e6});
  newer(table, "aspect", camera.aspect, {0.5, 2.0}, 1.0);
  table.read("principal_px", std::span(camera.principal_px.data(), 2), {-1e5, 1e5});
  table.read("k1", camera.k1, {-10, 10});
  table.read("k2", camera.k2, {-10, 10});
  std::string lens = camera.fisheye ? "fisheye" : "pinhole";
  if (!writes(table) || camera.fisheye) table.read("lens", lens);
  camera.fisheye = lens == "fisheye";
  if (!camera.fisheye && lens != "pinhole") table.fail("lens", R"(must be one of "pinhole", "fisheye")");
  newer(table, "k3", camera.k3, {-10, 10}, 0.0);
  newer(table, "k4", camera.k4, {-10, 10}, 0.0);
  if (!camera.fisheye) {
    for (const char* key : {"k3", "k4"}) {
      if (table.has(key)) table.fail(key, R"(needs lens = "fisheye")");
    }
  }
  table.read("position_mm", std::span(camera.position.data(), 3), {-1e4, 1e4, kMillimetres});
  table.read("rotation_rad", std::span(camera.rotation.data(), 3), {-3.2, 3.2});
  table.read("gel_index", camera.gelIndex, {1.0, 3.0});
}

void window(auto& table, Camera& camera) {
  table.read("window_index", camera.windowIndex, {1.0, 3.0});
  table.read("window_thickness_mm", camera.windowThickness, {0.0, 1000, kMillimetres});
}

void readCamera(TomlTable& table, Camera& camera, std::string& measuredWith) {
  pinhole(table, camera);
  table.read("measured_with", measuredWith);
  window(table, camera);
  camera.surfaces = readSurfaces(table.tables("surfaces"));
  for (const char* key : {"window_index", "window_thickness_mm"}) {
    if (!camera.surfaces.empty() && table.has(key))
      table.fail(key, "does not go with camera.surfaces: write a plane there");
  }
}

void deviations(auto& table, bool body, Uncertainty& uncertainty) {
  const Uncertainty usual;  // of a lens that was not measured
  table.read("youngs_modulus_relative", uncertainty.youngsModulus, {0.0, 1.0});
  if (body) {
    refuse(table, {"poisson_ratio", "thickness_mm", "layer_depth_mm", "marker_depth_mm", "marker_place_mm"});
  } else {
    table.read("poisson_ratio", uncertainty.poissonRatio, {0.0, 0.5});
    table.read("thickness_mm", uncertainty.thickness, {0.0, 1000, kMillimetres});
    table.read("layer_depth_mm", uncertainty.layerDepth, {0.0, 1000, kMillimetres});
    newer(table, "marker_depth_mm", uncertainty.markerDepth, {0.0, 1000, kMillimetres}, usual.markerDepth);
    newer(table, "marker_place_mm", uncertainty.markerPlace, {0.0, 1000, kMillimetres}, usual.markerPlace);
  }
  table.read("model_relative", uncertainty.model, {0.0, 1.0});
  table.read("focal_relative", uncertainty.focal, {0.0, 1.0});
  table.read("position_mm", std::span(uncertainty.position.data(), 3), {0.0, 1000, kMillimetres});
  table.read("rotation_rad", std::span(uncertainty.rotation.data(), 3), {0.0, 1.0});
  table.read("focal_distance_correlation", uncertainty.focalDistance, {-1.0, 1.0});
  newer(table, "principal_px", uncertainty.principal_px, {0.0, 1e3}, usual.principal_px);
  newer(table, "k1", uncertainty.k1, {0.0, 10.0}, usual.k1);
  newer(table, "k2", uncertainty.k2, {0.0, 10.0}, usual.k2);
}

void motion(auto& table, PictureMotion& motion) {
  table.read("shift_px", motion.shift_px, {0.0, 100.0});
  table.read("scale", motion.scale, {0.0, 0.1});
  table.read("roll_rad", motion.roll, {0.0, 0.1});
}

void creep(auto& table, CreepTerm& term) {
  require(table, {"share", "time_s", "deviation"});
  table.read("share", term.share, {0.0, 1.0});
  table.read("time_s", term.time_s, {1e-3, 1e6});
  table.read("deviation", term.deviation, {0.0, 1.0});
  if (!writes(table) || !term.correlation.empty()) table.read("correlation", term.correlation, {-1.0, 1.0});
}

std::vector<CreepTerm> readCreep(std::vector<TomlTable> tables) {
  std::vector<CreepTerm> terms;
  for (TomlTable& table : tables) {
    CreepTerm& term = terms.emplace_back();
    creep(table, term);
    if (terms.size() > kMostCreepTerms) {
      table.fail("share", "is of one term too many; at most " + std::to_string(kMostCreepTerms) + " are possible");
      break;
    }
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

/// The hash comes first: a truncated file must not pass as an uncalibrated one.
void calibration(auto& table, Calibration& calibration) {
  require(table, {"camera", "date", "hash"});
  table.read("hash", calibration.hash);
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
}

/// Reads all tables but those of creep.
/// \param body true: an influence file supplies the mechanics and the positions of markers and nodes
Sensor readSensor(TomlTable& root, bool body) {
  Sensor sensor;
  if (auto table = root.table("gel")) {
    table->read("youngs_modulus_pa", sensor.gel.youngsModulus, {1.0, 1e12});
    material(*table, body, sensor.gel);
  }
  std::vector<TomlTable> layers = root.tables("layers");
  if (root.has("layers")) sensor.layers.clear();
  for (TomlTable& table : layers) {
    markers(table, body, sensor.layers.emplace_back());
    if (!body) check(sensor.layers.back(), sensor.gel, root, "layers", &table);
  }
  if (layers.empty()) {
    if (root.has("layers")) root.fail("layers", "is empty: a sensor has markers");
    if (!body) {
      for (const MarkerLayer& layer : sensor.layers) check(layer, sensor.gel, root, "layers", nullptr);
    }
  }
  if (!body && !sensor.layers.empty()) sensor.nodes = nodesOver(sensor.layers.front());
  if (auto nodes = root.table("nodes")) {
    grid(*nodes, body, sensor.nodes);
    if (!body) check(sensor.nodes, sensor.gel, root, "nodes", &*nodes);
  }
  auto camera = root.table("camera");
  if (camera) readCamera(*camera, sensor.camera, sensor.measuredWith);
  check(sensor.camera, sensor.gel, root, "camera", camera ? &*camera : nullptr);
  if (auto table = root.table("uncertainty")) deviations(*table, body, sensor.uncertainty);
  if (auto table = root.table("picture_motion")) motion(*table, sensor.pictureMotion);
  if (auto table = root.table("calibration")) calibration(*table, sensor.calibration.emplace());
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
/// \param alone whether an influence file is an error
tl::expected<Sensor, FileError> read(tl::expected<TomlTable, FileError> root, const std::string& name,
                                     const std::string& influence = {}, bool alone = false) {
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
    if (alone && !influenceFile.empty())
      table->fail("influence_file", "must not be named by a gel file from elsewhere");
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

tl::expected<Sensor, FileError> parseGelAlone(std::string_view text, const std::string& name) {
  return read(TomlTable::parse(text, name), name, {}, true);
}

tl::expected<Sensor, FileError> loadGel(const std::string& path) {
  return read(TomlTable::load(path), path);
}

std::string gelText(const Sensor& sensor) {
  Sensor all = sensor;
  const bool body = sensor.body != nullptr;
  std::string text;
  TextTable table(text);
  const auto begin = [&text](const char* header) { text.append("\n").append(header).append("\n"); };
  if (all.calibration) {  // before everything else, as its hash
    TextTable made(text, "calibration.");
    calibration(made, *all.calibration);
    text += "\n";
  }
  table.read("format", kVersion, {});
  begin("[gel]");
  table.read("youngs_modulus_pa", all.gel.youngsModulus, {});
  if (body) table.read("influence_file", std::filesystem::absolute(sensor.body->file).string());
  material(table, body, all.gel);
  for (MarkerLayer& layer : all.layers) {
    begin("[[layers]]");
    markers(table, body, layer);
  }
  begin("[nodes]");
  grid(table, body, all.nodes);
  begin("[camera]");
  pinhole(table, all.camera);
  if (!all.measuredWith.empty()) table.read("measured_with", all.measuredWith);
  if (all.camera.surfaces.empty()) window(table, all.camera);
  for (RefractingSurface& surface : all.camera.surfaces) {
    begin("[[camera.surfaces]]");
    refraction(table, surface);
  }
  begin("[uncertainty]");
  deviations(table, body, all.uncertainty);
  begin("[picture_motion]");
  motion(table, all.pictureMotion);
  for (CreepTerm& term : all.creep) {
    begin("[[creep]]");
    creep(table, term);
  }
  return text;
}

}  // namespace sensor
