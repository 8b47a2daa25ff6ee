// Measures a photon transfer curve of two points: the centres of the markers, and the bare gel between them. The mean
// difference of two frames is subtracted, as the brightness of the whole picture may flicker.
#include "daemon/track/pixel_noise.h"

#include <algorithm>
#include <cmath>

namespace tractiond::track {

namespace {

constexpr int kLeast = 30;                             // pixels that a frame must have to be used
constexpr float kDarkest = 3.0F, kBrightest = 250.0F;  // [1/255 of the range]: beyond these the noise is clipped
constexpr double kLeastContrast = 10.0;                // [1/255 of the range]

}  // namespace

PixelNoise::PixelNoise(int markers) {
  for (Pixels* pixels : {&onMarkers_, &between_}) pixels->before.resize(static_cast<std::size_t>(markers));
  start();
}

void PixelNoise::start() {
  for (Pixels* pixels : {&onMarkers_, &between_}) {
    std::fill(pixels->before.begin(), pixels->before.end(), -1.0F);
    pixels->variance = pixels->level = 0.0;
    pixels->frames = 0;
  }
}

void PixelNoise::add(const Plane& plane, int first, std::span<const Vector> place_px, Vector between,
                     std::span<const std::uint8_t> valid) {
  leastContrast_ = kLeastContrast * double{plane.unit};
  addTo(onMarkers_, plane, first, place_px, {}, valid);
  addTo(between_, plane, first, place_px, between, valid);
}

void PixelNoise::addTo(Pixels& pixels, const Plane& plane, int first, std::span<const Vector> place_px, Vector offset,
                       std::span<const std::uint8_t> valid) {
  const float darkest = kDarkest * plane.unit, brightest = kBrightest * plane.unit;
  int count = 0;
  double sum = 0.0, square = 0.0, level = 0.0;
  for (std::size_t i = 0; i < place_px.size(); ++i) {
    float& before = pixels.before[static_cast<std::size_t>(first) + i];
    const Vector place = place_px[i] + offset;
    const float x = std::round((place.u - plane.u0) / plane.scale), y = std::round((place.v - plane.v0) / plane.scale);
    const bool inside =
        x >= 0.0F && y >= 0.0F && x < static_cast<float>(plane.width) && y < static_cast<float>(plane.height);
    if (!valid[i] || !inside) {
      before = -1.0F;
      continue;
    }
    const float now = plane.at(static_cast<std::ptrdiff_t>(x), static_cast<std::ptrdiff_t>(y));
    if (before >= darkest && before <= brightest && now >= darkest && now <= brightest) {
      const double difference = double{now} - double{before};
      ++count;
      sum += difference;
      square += difference * difference;
      level += 0.5 * (double{now} + double{before});
    }
    before = now;
  }
  if (count < kLeast) return;
  pixels.variance += 0.5 * (square - sum * sum / count) / (count - 1) / double{plane.noise};
  pixels.level += level / count;
  ++pixels.frames;
}

float PixelNoise::perLevel() const {
  if (onMarkers_.frames == 0 || between_.frames == 0) return 0.0F;
  const double contrast = onMarkers_.level / onMarkers_.frames - between_.level / between_.frames;
  const double growth = onMarkers_.variance / onMarkers_.frames - between_.variance / between_.frames;
  return std::abs(contrast) > leastContrast_ ? static_cast<float>(std::max(growth / contrast, 0.0)) : 0.0F;
}

}  // namespace tractiond::track
