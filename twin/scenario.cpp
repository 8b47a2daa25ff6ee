#include "twin/scenario.h"

#include "sensor/gel_file.h"
#include "twin/body_model.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <random>

namespace twin {

namespace {

using tractiond::FileError;
using tractiond::TomlTable;

constexpr int kVersion = 1;
constexpr double kMillimetres = 1e3;  // per metre

void readStream(TomlTable& table, Scenario& scenario) {
  std::string name(traitsOf(scenario.format).name);
  table.read("pixel_format", name);
  if (const auto format = formatByName(name)) {
    scenario.format = *format;
  } else {
    table.fail("pixel_format", "must be one of " + formatNames());
  }
  table.read("rate_hz", scenario.rate_hz, {1, 1000});
}

void readOptics(TomlTable& table, Optics& optics) {
  table.read("contrast_levels", optics.contrast, {1, 255});
  table.read("background_levels", optics.background, {0, 255});
  table.read("blur_px", optics.blur_px, {0, 5});
  table.read("cross_talk", optics.crossTalk, {0, 1});
  table.read("read_noise_levels", optics.readNoise, {0, 15});
  table.read("shot_noise_levels", optics.shotNoise, {0, 10});
  table.read("light_slope", std::span(optics.lightSlope.data(), 2), {-0.3, 0.3});
  table.read("light_falloff", optics.lightFalloff, {0, 0.8});
  table.read("light_drift", optics.drift, {0, 0.9});
  table.read("light_drift_period_s", optics.driftPeriod, {0.1, 1e6});
  table.read("diameter_scatter", optics.variety.diameter, {0, 0.5});
  table.read("contrast_scatter", optics.variety.contrast, {0, 0.5});
  table.read("elongation", optics.variety.elongation, {0, 1});
  int varietySeed = 0;
  table.read("variety_seed", varietySeed, {0, 1e9});
  optics.variety.seed = static_cast<unsigned>(varietySeed);
  for (TomlTable& entry : table.tables("highlights")) {
    Highlight highlight;
    entry.read("centre_px", std::span(highlight.centre_px.data(), 2), {-1e4, 1e4});
    entry.read("radius_px", highlight.radius_px, {1, 1000});
    entry.read("strength_levels", highlight.strength, {0, 1000});
    optics.highlights.push_back(highlight);
  }
  for (TomlTable& entry : table.tables("dust_specks")) {
    Speck speck;
    entry.read("centre_px", std::span(speck.centre_px.data(), 2), {-1e4, 1e4});
    entry.read("radius_px", speck.radius_px, {0.2, 10});
    optics.dust.push_back(speck);
  }
}

/// Reads a quantity at each key time. A single value holds for all times.
std::vector<double> readTrack(TomlTable& table, const char* key, std::size_t count, const tractiond::Range& range) {
  std::vector<double> values(1, 0.0);
  table.read(key, values, range);
  if (values.size() == 1) values.resize(count, values.front());
  if (values.size() != count) {
    table.fail(key, "must have as many values as time_s, " + std::to_string(count) + ", or one");
    values.resize(count);
  }
  return values;
}

std::vector<double> readTimes(TomlTable& table) {
  std::vector<double> times = {0.0};
  table.read("time_s", times, {0, 1e6});
  if (times.empty()) {
    table.fail("time_s", "must have a time");
    times = {0.0};  // reading of the other values continues
  } else if (std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()) != times.end()) {
    table.fail("time_s", "must be ascending");
  }
  return times;
}

/// \param body that is touched; empty: a block
Contact readContact(TomlTable& table, const sensor::Gel& gel, const std::optional<BodyModel>& body) {
  Contact contact;
  std::string shape = "hertz";
  table.read("shape", shape);
  if (shape != "hertz" && shape != "disc") table.fail("shape", R"(must be "hertz" or "disc")");
  contact.shape = shape == "disc" ? Contact::Shape::kDisc : Contact::Shape::kHertz;
  if (!table.has("radius_mm")) table.fail("radius_mm", "is missing");
  table.read("radius_mm", contact.radius, {0.5, 1000, kMillimetres});

  contact.times = readTimes(table);
  const std::size_t count = contact.times.size();
  const auto track = [&](const char* key, double most, double perUnit) {
    return readTrack(table, key, count, {-most, most, perUnit});
  };
  const auto x = track("x_mm", 1000, kMillimetres), y = track("y_mm", 1000, kMillimetres);
  const auto forceX = track("force_x_n", 1000, 1), forceY = track("force_y_n", 1000, 1);
  const auto forceZ = track("force_z_n", 1000, 1), torque = track("torque_n_mm", 1e5, kMillimetres);
  for (std::size_t i = 0; i < count; ++i) {
    contact.states.push_back({{x[i], y[i]}, {forceX[i], forceY[i], forceZ[i]}, torque[i]});
    const ContactState& state = contact.states.back();
    const Eigen::Vector2d room = 0.5 * gel.size.head<2>() - state.position.cwiseAbs();
    const bool isOnGel = body ? body->load(contact, state).isWithin : room.minCoeff() >= contact.radius;
    if (!isOnGel) table.fail("radius_mm", "and the position reach beyond the gel's surface");
  }
  return contact;
}

sensor::CreepTerm readCreep(TomlTable& table) {
  sensor::CreepTerm term;
  for (const char* key : {"share", "time_s"}) {
    if (!table.has(key)) table.fail(key, "is missing");
  }
  table.read("share", term.share, {0, 10});
  table.read("time_s", term.time_s, {1e-3, 1e6});
  return term;
}

void readWarmth(TomlTable& table, Warmth& warmth) {
  warmth.times = readTimes(table);
  warmth.rise = readTrack(table, "rise_k", warmth.times.size(), {-100, 100});
  table.read("expansion_per_k", warmth.expansion, {0, 1e-2});
  table.read("shift_px_per_k", std::span(warmth.shift_px.data(), 2), {-100, 100});
  table.read("scale_per_k", warmth.scale, {-0.1, 0.1});
  table.read("roll_rad_per_k", warmth.roll, {-0.1, 0.1});
}

Absence readAbsence(TomlTable& table, int markerCount) {
  Absence absence{.markers = {}, .from_s = 0.0, .to_s = 1e9};
  table.read("from_s", absence.from_s, {0, 1e6});
  table.read("to_s", absence.to_s, {0, 1e6});
  if (absence.to_s <= absence.from_s) table.fail("to_s", "must be after from_s");
  if (table.has("markers") == table.has("fraction")) table.fail("markers", "or fraction must be given, and not both");
  std::vector<double> markers;
  table.read("markers", markers, {0.0, markerCount - 1.0});
  for (const double marker : markers) absence.markers.push_back(static_cast<int>(marker));
  double fraction = 0.0;
  int seed = 0;
  table.read("fraction", fraction, {0, 1});
  table.read("seed", seed, {0, 1e9});
  if (markers.empty()) {
    std::vector<int> all(static_cast<std::size_t>(markerCount));
    std::iota(all.begin(), all.end(), 0);
    std::shuffle(all.begin(), all.end(), std::mt19937(static_cast<unsigned>(seed)));
    absence.markers.assign(all.begin(), all.begin() + std::lround(fraction * markerCount));
  }
  return absence;
}

void readGripper(TomlTable& table, HandOptions& hand) {
  table.read("opening_mm", hand.opening, {0, 1000, kMillimetres});
  table.read("speed_mm_s", hand.speed, {1, 1000, kMillimetres});
  table.read("acceleration_m_s2", hand.acceleration, {0.1, 100});
}

Disturbance readDisturbance(TomlTable& table) {
  Disturbance disturbance;
  table.read("at_s", disturbance.at_s, {0, 1e6});
  table.read("duration_s", disturbance.duration_s, {1e-3, 1e3});
  table.read("force_n", std::span(disturbance.force.data(), 2), {-100, 100});
  table.read("acceleration_m_s2", std::span(disturbance.acceleration.data(), 2), {-100, 100});
  table.read("mass_g", disturbance.mass, {0, 1e4, 1e3});
  return disturbance;
}

void readObject(TomlTable& table, HandOptions& hand) {
  std::string shape = "ball";
  table.read("shape", shape);
  if (shape != "ball" && shape != "box") table.fail("shape", R"(must be "ball" or "box")");
  table.read("width_mm", hand.width, {5, 500, kMillimetres});
  hand.profile = shape == "ball" ? Profile{0.0, 0.5 * hand.width} : Profile{4e-3, 10e-3};
  if (shape == "box") table.read("face_radius_mm", hand.profile.flat, {0.5, 8, kMillimetres});
  table.read("curvature_mm", hand.profile.curvature, {1, 1000, kMillimetres});
  table.read("mass_g", hand.mass, {1, 1e4, 1e3});
  table.read("friction", hand.friction, {0.01, 3});
  table.read("stiffness_n_mm", hand.stiffness, {0.1, 1e6, 1e-3});
  table.read("breaking_n", hand.breaking, {0.01, 1e9});
  for (TomlTable& entry : table.tables("disturbances")) hand.disturbances.push_back(readDisturbance(entry));
}

/// Returns the contacts that an object in the hand can have with one finger.
std::vector<Contact> handContacts() {
  std::vector<Contact> contacts;
  const Eigen::Vector2d end(Hand::kReach, Hand::kReach);
  for (const double radius : RoundContact::radii()) {
    contacts.push_back({Contact::Shape::kHertz, radius, {0.0, 1.0}, {{.position = -end}, {.position = end}}});
  }
  return contacts;
}

void readHand(TomlTable& root, Scenario& scenario) {
  auto gripper = root.table("gripper"), object = root.table("object");
  if (!gripper && !object) return;
  scenario.hand.emplace();
  if (gripper) readGripper(*gripper, *scenario.hand);
  if (object) readObject(*object, *scenario.hand);
  const char* const key = gripper ? "gripper" : "object";
  if (!scenario.contacts.empty()) root.fail(key, "and contacts exclude each other: the object makes the contacts");
  if (scenario.sensor.body) return root.fail(key, "needs a block, and the gel is another body");
  scenario.contacts = handContacts();
  const double needed = Hand::kReach + RoundContact::radii().back();
  if (0.5 * scenario.sensor.gel.size.head<2>().minCoeff() < needed) {
    root.fail(key, "needs a gel of at least " + std::to_string(std::lround(2 * kMillimetres * needed)) + " mm");
  }
}

/// Returns the last of the times that is not after `time_s`, the first if there is none, and the share of the way from
/// it to the next; 0 outside of the times.
std::pair<std::size_t, double> placeIn(const std::vector<double>& times, double time_s) {
  const auto after = std::upper_bound(times.begin(), times.end(), time_s);
  if (after == times.begin()) return {0, 0.0};
  const auto index = static_cast<std::size_t>(after - times.begin()) - 1;
  if (after == times.end()) return {index, 0.0};
  return {index, (time_s - times[index]) / (times[index + 1] - times[index])};
}

/// Reads a gel file for the pictures: what it knows of its creep is what the gel does, unless the scenario says.
tl::expected<void, FileError> takeGel(const std::string& path, Scenario& scenario) {
  auto sensor = sensor::loadGel(path);
  if (!sensor) {
    FileError error = sensor.error();
    const std::size_t end = path.rfind("_gel.toml");
    if (error.unreadable && end != std::string::npos) {
      const std::string file = std::filesystem::path(path).filename();
      error.what +=
          "; `traction-gel mesh " + path.substr(0, end) + ".toml` makes it here, and --gel " + file + " names it";
    }
    return tl::unexpected(error);
  }
  scenario.sensor = *std::move(sensor);
  scenario.creep = scenario.sensor.creep;
  return {};
}

/// \param name, gel as of parseScenario()
tl::expected<Scenario, FileError> read(tl::expected<TomlTable, FileError> root, const std::string& name,
                                       const std::string& gel) {
  if (!root) return tl::unexpected(root.error());
  int version = 0;
  if (!root->has("format")) root->fail("format", "is missing: a scenario starts with format = 1");
  root->read("format", version, {kVersion, kVersion});

  Scenario scenario;
  std::string gelFile;
  root->read("gel_file", gelFile);
  if (gelFile.empty()) scenario.sensor = sensor::readGel(*root);
  if (!gelFile.empty() || !gel.empty()) {
    const auto named = std::filesystem::path(name).parent_path() / gelFile;
    if (auto taken = takeGel(gel.empty() ? named.lexically_normal().string() : gel, scenario); !taken) {
      return tl::unexpected(taken.error());
    }
  }
  std::optional<BodyModel> body;
  if (scenario.sensor.body) {
    const sensor::NodeGrid& nodes = scenario.sensor.nodes;
    if (std::min(nodes.columns, nodes.rows) < 4) {
      root->fail("gel_file", "has a body with fewer than 4 x 4 nodes, between which the twin cannot interpolate");
    } else {
      body.emplace(scenario.sensor);
    }
  }
  if (auto table = root->table("stream")) readStream(*table, scenario);
  if (auto table = root->table("optics")) readOptics(*table, scenario.optics);
  for (TomlTable& table : root->tables("contacts")) {
    scenario.contacts.push_back(readContact(table, scenario.sensor.gel, body));
    scenario.period_s = std::max(scenario.period_s, scenario.contacts.back().times.back());
  }
  if (root->has("creep")) scenario.creep.clear();
  for (TomlTable& table : root->tables("creep")) scenario.creep.push_back(readCreep(table));
  if (auto table = root->table("warmth")) {
    readWarmth(*table, scenario.warmth);
    scenario.period_s = std::max(scenario.period_s, scenario.warmth.times.back());
  }
  for (TomlTable& table : root->tables("missing")) {
    scenario.absences.push_back(readAbsence(table, scenario.sensor.markerCount()));
  }
  readHand(*root, scenario);
  root->read("period_s", scenario.period_s, {0.1, 1e6});
  if (auto done = root->finish(); !done) return tl::unexpected(done.error());
  return scenario;
}

}  // namespace

ContactState Contact::at(double time_s) const {
  if (states.empty()) return {};
  const auto [index, f] = placeIn(times, time_s);
  const ContactState& a = states[index];
  if (f == 0.0) return a;
  const ContactState& b = states[index + 1];
  return {a.position + f * (b.position - a.position), a.force + f * (b.force - a.force),
          a.torque + f * (b.torque - a.torque)};
}

double Warmth::at(double time_s) const {
  const auto [index, f] = placeIn(times, time_s);
  return f == 0.0 ? rise[index] : rise[index] + f * (rise[index + 1] - rise[index]);
}

void Resultant::add(const ContactState& contact) {
  const Eigen::Vector2d& p = contact.position;
  const Eigen::Vector3d& f = contact.force;
  force += f;
  moment += Eigen::Vector3d(p.y() * f.z(), -p.x() * f.z(), p.x() * f.y() - p.y() * f.x() + contact.torque);
}

tl::expected<Scenario, FileError> parseScenario(std::string_view text, const std::string& name,
                                                const std::string& gel) {
  return read(TomlTable::parse(text, name), name, gel);
}

tl::expected<Scenario, FileError> loadScenario(const std::string& path, const std::string& gel) {
  return read(TomlTable::load(path), path, gel);
}

}  // namespace twin
