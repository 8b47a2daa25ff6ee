#include "client/input/profile.h"

#include "base/service/config_table.h"
#include "base/toml_table.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <system_error>
#include <utility>

namespace traction::input {
namespace {

using tractiond::FileError;
using tractiond::Range;
using tractiond::TomlTable;

constexpr Range kForce{0.001, 1000.0};
constexpr Range kDeadZone{0.0, 1000.0};
constexpr Range kMoment{0.0, 1e6, 1e3};                                // [N mm]
constexpr Range kTurn{0.01, 1e6, 1e3};                                 // [N mm]
constexpr Range kGain{-1e6, 1e6}, kMomentGain{-1e6, 1e6, 1e-3};        // [counts / N], [counts / N mm]
constexpr Range kGradient{0.0, 1e6, 1e-6}, kZoomGain{-1e6, 1e6, 1e6};  // [kPa / mm], [notches / s / (kPa / mm)]
constexpr Range kSize{1.0, 1000.0, 1e3};                               // [mm]
constexpr Range kStroke{0.1, 1000.0};                                  // [mm]
constexpr Range kTime{0.0, 10'000.0, 1e-6};                            // [ms], in memory [ns]
constexpr Range kAngle{-360.0, 360.0, 180.0 / std::numbers::pi};

void read(TomlTable& table, PointerOptions& pointer) {
  auto decision_ns = static_cast<double>(pointer.decision_ns);
  table.read("dead_zone_N", pointer.deadZone_N, kDeadZone);
  table.read("speed_per_N", pointer.speed_N, kGain);
  table.read("press_N", pointer.press_N, kForce);
  table.read("hard_press_N", pointer.hardPress_N, kForce);
  table.read("release_N", pointer.release_N, kForce);
  table.read("decision_ms", decision_ns, kTime);
  pointer.decision_ns = static_cast<std::int64_t>(decision_ns);
  if (!(pointer.release_N < pointer.press_N)) table.fail("release_N", "must be below press_N, by more than tremor");
  if (!(pointer.press_N < pointer.hardPress_N)) table.fail("hard_press_N", "must be above press_N");
}

void read(TomlTable& table, TouchOptions& touch) {
  table.read("full_press_N", touch.fullPress_N, kForce);
}

void read(TomlTable& table, PenOptions& pen) {
  table.read("full_press_N", pen.fullPress_N, kForce);
}

void read(TomlTable& table, TextOptions& text) {
  std::string alphabet;
  table.read("alphabet", alphabet);
  text.alphabet = alphabet;
  table.read("least_mm", text.leastExtent_mm, kStroke);
  auto most_ns = static_cast<double>(text.press.most_ns);
  table.read("tap_N", text.press.tap_N, kForce);
  table.read("hard_press_N", text.press.hardPress_N, kForce);
  table.read("press_ms", most_ns, kTime);
  table.read("turn_N_mm", text.press.turn_Nm, kTurn);
  text.press.most_ns = static_cast<std::int64_t>(most_ns);
  if (!(text.press.tap_N < text.press.hardPress_N)) table.fail("hard_press_N", "must be above tap_N");
  for (std::size_t i = 0; i < text.pressSymbols.size(); ++i) {
    constexpr std::array kNames = {"tap", "hard_press", "turn_left", "turn_right"};  // as Press has them
    std::string& symbol = text.pressSymbols[i];
    table.read(kNames.at(i), symbol);
    if (!symbol.empty() && Keyboard::keyOf(symbol) == 0) table.fail(kNames.at(i), "no key types \"" + symbol + "\"");
  }
}

void read(TomlTable& table, ZoomOptions& zoom) {
  table.read("dead_zone_kPa_mm", zoom.deadZone_Pa_m, kGradient);
  table.read("notches_per_kPa_mm", zoom.gain, kZoomGain);
}

void read(TomlTable& table, SpacenavOptions& spacenav) {
  std::string socket;
  table.read("socket", socket);
  spacenav.socket = socket;
  table.read("dead_zone_N", spacenav.axes.deadZone_N, kDeadZone);
  table.read("dead_zone_N_mm", spacenav.axes.deadZone_Nm, kMoment);
  table.read("counts_per_N", spacenav.axes.gain_N, kGain);
  table.read("counts_per_N_mm", spacenav.axes.gain_Nm, kMomentGain);
}

void read(TomlTable& table, TuioOptions& tuio) {
  table.read("address", tuio.address);
  table.read("full_press_N", tuio.fullPress_N, kForce);
}

void read(TomlTable& table, OscOptions& osc) {
  table.read("address", osc.address);
  table.read("prefix", osc.prefix);
  table.read("affine_dead_zone_kPa_mm", osc.gradientDeadZone_Pa_m, kGradient);
  if (!osc.prefix.starts_with('/')) table.fail("prefix", "must begin with /");
}

/// Reads the table of an output, if it is there.
template <typename Options>
void read(TomlTable& root, const char* key, std::optional<Options>& output) {
  if (auto table = root.table(key)) read(*table, output.emplace());
}

tl::expected<Profile, tractiond::Error> read(tl::expected<TomlTable, FileError> root) {
  if (!root)
    return tl::unexpected(tractiond::asError(root.error(), "the shipped profiles are in " + shippedFolder().string()));
  Profile profile;
  root->read("turn_deg", profile.turn_rad, kAngle);
  root->read("area_mm", profile.area.size_m, kSize);
  read(*root, "pointer", profile.pointer);
  read(*root, "touch", profile.touch);
  read(*root, "pen", profile.pen);
  read(*root, "text", profile.text);
  read(*root, "zoom", profile.zoom);
  read(*root, "spacenav", profile.spacenav);
  read(*root, "tuio", profile.tuio11);
  read(*root, "tuio2", profile.tuio20);
  read(*root, "osc", profile.osc);
  if (profile.pen && (profile.pointer || profile.touch))
    root->fail("pen", "is one device more for the same contact: leave it out, or pointer and touch");
  if (profile.text && (profile.pointer || profile.touch || profile.pen))
    root->fail("text", "is one device more for the same contact: leave it out, or pointer, touch and pen");
  const bool isEmpty = !profile.pointer && !profile.touch && !profile.pen && !profile.text && !profile.zoom &&
                       !profile.spacenav && !profile.tuio11 && !profile.tuio20 && !profile.osc;
  if (const auto sound = root->finish(); !sound) return tl::unexpected(tractiond::asError(sound.error()));
  if (isEmpty)
    return tl::unexpected(
        tractiond::Error{EX_CONFIG, "the profile has no output", "",
                         "it needs a table: pointer, touch, pen, text, zoom, spacenav, tuio, tuio2 or osc"});
  return profile;
}

}  // namespace

std::filesystem::path shippedFolder() {
  std::error_code ignored;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  return program.parent_path().parent_path() / "share/tractiond/input";
}

tl::expected<Profile, tractiond::Error> parseProfile(std::string_view text, const std::string& name) {
  return read(TomlTable::parse(text, name));
}

tl::expected<Profile, tractiond::Error> loadProfile(const std::string& nameOrPath) {
  if (nameOrPath.find_first_of("/.") != std::string::npos) return read(TomlTable::load(nameOrPath));
  return read(TomlTable::load(shippedFolder() / (nameOrPath + ".toml")));
}

}  // namespace traction::input
