// Checks the light first, as all other checks need it. Then looks for spots of other sizes, of other colours and for
// dark ones; then for spots that look right but are not at the expected places.
#include "daemon/track/diagnosis.h"

#include "daemon/track/nominal.h"
#include "daemon/track/spot_search.h"

#include <spdlog/fmt/fmt.h>

#include <array>
#include <cmath>
#include <vector>

namespace tractiond::track {

namespace {

constexpr int kDark = 40, kFlat = 15;  // levels
constexpr double kSaturated = 0.2;     // share of the pixels
constexpr double kMany = 0.5;          // spots that are worth reporting, share of the number of markers
constexpr std::array<double, 6> kSizes = {0.35, 0.5, 0.7, 1.5, 2.1, 3.0};
constexpr double kOtherSpacing = 0.12;  // relative

/// Explains what is wrong with the light; empty: nothing.
std::string aboutLight(const PlainPicture& picture) {
  std::array<std::size_t, 256> count{};
  for (const std::uint8_t level : picture.levels) ++count[level];
  const std::size_t all = picture.levels.size();
  // Ignores a thousandth of the pixels on each side: hot pixels and dust.
  std::size_t below = 0;
  int darkest = 255, brightest = 0;
  for (int level = 0; level < 256; ++level) {
    if (below <= all / 1000) darkest = level;
    if (all - below > all / 1000) brightest = level;
    below += count[static_cast<std::size_t>(level)];
  }
  const double saturated = static_cast<double>(count[255]) / static_cast<double>(all);
  if (brightest < kDark) {
    return fmt::format(
        "the picture is dark: its brightest pixels have {} of 255 levels; light it, open the iris or expose longer",
        brightest);
  }
  if (saturated > kSaturated) {
    return fmt::format("{:.0f} % of the picture is saturated; less light, a smaller iris or a shorter exposure",
                       100.0 * saturated);
  }
  if (brightest - darkest < kFlat) {
    return fmt::format("the picture is even: all between {} and {} of 255 levels; is the lens covered?", darkest,
                       brightest);
  }
  return "";
}

/// Explains why too few spots look like markers of the layer.
std::string aboutSpots(const sensor::MarkerLayer& layer, double radius_px, std::size_t asDescribed,
                       LayerChannels channels, bool coloured, SpotSearch& search) {
  const char* name = nameOf(layer.colour);
  const auto enough = static_cast<std::size_t>(kMany * layer.count());
  const auto count = [&](LayerChannels where, double size, bool dark) {
    return search.spots(where, size * radius_px, dark).size();
  };
  std::size_t most = 0;
  double ofSize = 0.0;
  for (const double size : kSizes) {
    if (size * radius_px < 0.8 || size * radius_px > 9.0) continue;
    const std::size_t seen = count(channels, size, layer.darker);
    if (seen <= most) continue;
    most = seen;
    ofSize = size;
  }
  if (most >= enough && most > 2 * asDescribed) {
    return fmt::format("{} {} spots of about {:.1f} times the size: {}", most, name, ofSize,
                       ofSize > 1.0 ? "is the lens out of focus, or the camera too near?"
                                    : "is the camera too far away, or diameter_mm wrong?");
  }
  if (coloured) {
    constexpr std::array<const char*, 3> kChannels = {"red", "green", "blue"};
    for (const int channel : {0, 1, 2}) {
      if (channel == channels.own) continue;
      const std::size_t seen = count({channel, channels.own}, 1.0, layer.darker);
      if (seen < enough) continue;
      return fmt::format("{} {} spots and {} {} ones: check the colours of the layers, and the camera's white balance",
                         seen, kChannels[static_cast<std::size_t>(channel)], asDescribed, name);
    }
    const std::size_t white = count({channels.own, -1}, 1.0, layer.darker);
    if (white >= enough) {
      return fmt::format(
          "{} spots that are as bright in the other colour as in {}: check light, filter and white balance", white,
          name);
    }
  }
  const std::size_t opposite = count({channels.own, -1}, 1.0, !layer.darker);
  if (opposite >= enough) {
    return fmt::format("{} spots that are {} than what surrounds them: check darker of that layer", opposite,
                       layer.darker ? "brighter" : "darker");
  }
  return fmt::format("{} spots that look like {} markers", asDescribed, name);
}

std::string aboutLayer(const sensor::Sensor& sensor, std::size_t index, const PlainPicture& picture,
                       SpotSearch& search) {
  const sensor::MarkerLayer& layer = sensor.layers[index];
  const double radius_px = markerRadius(sensor, layer);
  const LayerChannels channels = channelsOf(layer, picture);
  const auto found = search.spots(channels, radius_px, layer.darker);
  if (static_cast<double>(found.size()) < kMany * layer.count()) {
    const bool coloured = picture.channels > 1 && layer.colour != sensor::Colour::kGrey;
    return aboutSpots(layer, radius_px, found.size(), channels, coloured, search);
  }
  const std::vector<Vector> places = nominalPlaces(sensor);
  const Lattice lattice = latticesOf(sensor)[index];
  std::vector<Spot> described;
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) described.push_back({places[i].u, places[i].v});
  const auto seen = spacingOf(found), expected = spacingOf(described);
  if (seen && expected && std::abs(*seen / *expected - 1.0F) > kOtherSpacing) {
    return fmt::format("{} {} spots, {:.1f} px apart instead of {:.1f}: check pitch_mm and the camera's distance",
                       found.size(), nameOf(layer.colour), *seen, *expected);
  }
  return fmt::format("{} {} spots that do not lie in a grid of {} x {}", found.size(), nameOf(layer.colour),
                     layer.columns, layer.rows);
}

}  // namespace

std::string diagnose(const sensor::Sensor& sensor, const MarkerSight& sight, const PlainPicture& picture) {
  std::string text;
  std::vector<std::size_t> few;
  for (std::size_t i = 0; i < sensor.layers.size(); ++i) {
    const MarkerSight::Layer& layer = sight.layers[i];
    text += fmt::format("{}{}: {} of {} markers", i > 0 ? ", " : "", nameOf(sensor.layers[i].colour), layer.found,
                        layer.expected);
    if (layer.found < kMany * layer.expected) few.push_back(i);
  }
  if (picture.levels.empty() || few.empty()) return text;
  if (const std::string light = aboutLight(picture); !light.empty()) return text + "; " + light;
  SpotSearch search(sensor.markerCount(), picture);
  for (const std::size_t i : few) text += "; seen: " + aboutLayer(sensor, i, picture, search);
  return text;
}

}  // namespace tractiond::track
