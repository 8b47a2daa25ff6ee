// Checks the light first, as all other checks need it. Then looks for spots of other sizes, of other colours and for
// dark ones; then for spots that look right but are not at the expected places.
#include "daemon/track/diagnosis.h"

#include "daemon/track/nominal.h"
#include "daemon/track/spot_search.h"
#include "sensor/colour_name.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

namespace tractiond::track {

namespace {

constexpr int kDark = 40, kFlat = 15;  // levels
constexpr double kSaturated = 0.2;     // share of the pixels
constexpr double kMany = 0.5;          // spots that are worth reporting, share of the number of markers
constexpr std::array<double, 6> kSizes = {0.35, 0.5, 0.7, 1.5, 2.1, 3.0};
constexpr double kOtherSpacing = 0.12;  // relative

struct Light {
  int darkest = 255, brightest = 0;
  double saturated = 0.0;
};

Light lightOf(const PlainPicture& picture) {
  Light light;
  std::array<std::size_t, 256> count{};
  for (const std::uint8_t level : picture.levels) ++count[level];
  const std::size_t all = picture.levels.size();
  // Ignores a thousandth of the pixels on each side: hot pixels and dust.
  std::size_t below = 0;
  for (int level = 0; level < 256; ++level) {
    if (below <= all / 1000) light.darkest = level;
    if (all - below > all / 1000) light.brightest = level;
    below += count[static_cast<std::size_t>(level)];
  }
  light.saturated = static_cast<double>(count[255]) / static_cast<double>(all);
  return light;
}

std::string aboutLayer(const sensor::Sensor& sensor, std::size_t index, const PlainPicture& picture,
                       SpotSearch& search) {
  const sensor::MarkerLayer& layer = sensor.layers[index];
  const char* name = nameOf(layer.colour);
  const double radius_px = markerRadius(sensor, layer);
  const bool coloured = picture.channels > 1 && layer.colour != sensor::Colour::kGrey, dark = layer.darker;
  const LayerChannels channels = channelsOf(layer, picture);
  const auto enough = static_cast<std::size_t>(kMany * layer.count());
  const std::size_t asDescribed = search.spots(channels, radius_px, dark).size();

  std::size_t most = 0;
  double ofSize = 0.0;
  for (const double size : kSizes) {
    const double radius = size * radius_px;
    if (radius < 0.8 || radius > 9.0) continue;
    const std::size_t seen = search.spots(channels, radius, dark).size();
    if (seen <= most) continue;
    most = seen;
    ofSize = size;
  }
  if (asDescribed < enough && most >= enough && most > 2 * asDescribed) {
    return fmt::format("{} {} spots of about {:.1f} times the size: {}", most, name, ofSize,
                       ofSize > 1.0 ? "is the lens out of focus, or the camera too near?"
                                    : "is the camera too far away, or diameter_mm wrong?");
  }
  if (asDescribed < enough && coloured) {
    constexpr std::array<const char*, 3> kChannels = {"red", "green", "blue"};
    for (const int channel : {0, 1, 2}) {
      if (channel == channels.own) continue;
      const std::size_t seen = search.spots({channel, channels.own}, radius_px, dark).size();
      if (seen < enough) continue;
      return fmt::format("{} {} spots and {} {} ones: check the colours of the layers, and the camera's white balance",
                         seen, kChannels[static_cast<std::size_t>(channel)], asDescribed, name);
    }
    const std::size_t white = search.spots({channels.own, -1}, radius_px, dark).size();
    if (white >= enough) {
      return fmt::format(
          "{} spots that are as bright in the other colour as in {}: check light, filter and white balance", white,
          name);
    }
  }
  if (asDescribed < enough) {
    const std::size_t opposite = search.spots({channels.own, -1}, radius_px, !dark).size();
    if (opposite >= enough) {
      return fmt::format("{} spots that are {} than what surrounds them: check darker of that layer", opposite,
                         dark ? "brighter" : "darker");
    }
    return fmt::format("{} spots that look like {} markers", asDescribed, name);
  }
  const std::vector<Vector> places = nominalPlaces(sensor);
  const Lattice lattice = latticesOf(sensor)[index];
  std::vector<Spot> described;
  for (int i = 0; i < lattice.count(); ++i) {
    const Vector place = places[static_cast<std::size_t>(lattice.first + i)];
    described.push_back({place.u, place.v});
  }
  const auto seen = spacingOf(search.spots(channels, radius_px, dark)), expected = spacingOf(described);
  if (seen && expected && std::abs(*seen / *expected - 1.0F) > kOtherSpacing) {
    return fmt::format("{} {} spots, {:.1f} px apart instead of {:.1f}: check pitch_mm and the camera's distance",
                       asDescribed, name, *seen, *expected);
  }
  return fmt::format("{} {} spots that do not lie in a grid of {} x {}", asDescribed, name, layer.columns, layer.rows);
}

}  // namespace

std::string diagnose(const sensor::Sensor& sensor, const MarkerSight& sight, const PlainPicture& picture) {
  std::string text;
  const auto add = [&](const std::string& part, const char* between) { text += (text.empty() ? "" : between) + part; };
  bool fewSpots = false;
  for (std::size_t i = 0; i < sensor.layers.size(); ++i) {
    const MarkerSight::Layer& layer = sight.layers[i];
    add(fmt::format("{}: {} of {} markers", nameOf(sensor.layers[i].colour), layer.found, layer.expected), ", ");
    fewSpots = fewSpots || layer.found < kMany * layer.expected;
  }
  if (picture.levels.empty() || !fewSpots) return text;
  const Light light = lightOf(picture);
  if (light.brightest < kDark) {
    add(fmt::format(
            "the picture is dark: its brightest pixels have {} of 255 levels; light it, open the iris or expose longer",
            light.brightest),
        "; ");
    return text;
  }
  if (light.saturated > kSaturated) {
    add(fmt::format("{:.0f} % of the picture is saturated; less light, a smaller iris or a shorter exposure",
                    100.0 * light.saturated),
        "; ");
    return text;
  }
  if (light.brightest - light.darkest < kFlat) {
    add(fmt::format("the picture is even: all between {} and {} of 255 levels; is the lens covered?", light.darkest,
                    light.brightest),
        "; ");
    return text;
  }
  SpotSearch search(sensor.markerCount(), picture);
  for (std::size_t i = 0; i < sensor.layers.size(); ++i) {
    if (sight.layers[i].found >= kMany * sight.layers[i].expected) continue;
    add("seen: " + aboutLayer(sensor, i, picture, search), "; ");
  }
  return text;
}

}  // namespace tractiond::track
