// Markers are sought in each channel, brighter and darker than the mean of a box around each pixel: what exceeds half
// of the strongest contrast is grouped into spots, of which those of the usual size and shape count.
#include "client/viewer/look.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace traction::view {

namespace {

constexpr int kFewest = 16;             // markers: a grid has four by four at least
constexpr float kFaintest = 8.0F;       // levels: below it spots are no markers
constexpr float kOverNoise = 6.0F;      // of the strongest contrast, against the difference of two neighbours
constexpr double kMostAreas = 2.5;      // of a spot against the median, or its inverse
constexpr double kMostElongated = 1.7;  // sides of a spot's box

struct Plane {
  int width = 0, height = 0;
  std::vector<float> levels;
};

/// Returns the difference of a channel to the mean of a box around each pixel, by sums over rows and columns.
Plane contrastOf(const Snapshot& snapshot, std::size_t channel) {
  Plane contrast{static_cast<int>(snapshot.width), static_cast<int>(snapshot.height), {}};
  const int radius = std::max(8, std::min(contrast.width, contrast.height) / 24);
  const auto stride = std::size_t{snapshot.width} + 1;
  std::vector<double> sums(stride * (std::size_t{snapshot.height} + 1));
  const auto sum = [&](int x, int y) -> double& {
    return sums[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x)];
  };
  const auto level = [&](int x, int y) {
    const auto pixel = static_cast<std::size_t>(y) * snapshot.width + static_cast<std::size_t>(x);
    return static_cast<float>(snapshot.levels[snapshot.channels * pixel + channel]);
  };
  for (int y = 0; y < contrast.height; ++y) {
    double row = 0.0;
    for (int x = 0; x < contrast.width; ++x) sum(x + 1, y + 1) = sum(x + 1, y) + (row += level(x, y));
  }
  for (int y = 0; y < contrast.height; ++y) {
    const int top = std::max(0, y - radius), bottom = std::min(contrast.height, y + radius + 1);
    for (int x = 0; x < contrast.width; ++x) {
      const int left = std::max(0, x - radius), right = std::min(contrast.width, x + radius + 1);
      const double mean = (sum(right, bottom) - sum(left, bottom) - sum(right, top) + sum(left, top)) /
                          (static_cast<double>(right - left) * (bottom - top));
      contrast.levels.push_back(level(x, y) - static_cast<float>(mean));
    }
  }
  return contrast;
}

struct Spot {
  double u = 0.0, v = 0.0;
  double area = 0.0;
  int left = 0, right = 0, top = 0, bottom = 0;

  bool isRound() const {
    const double width = right - left + 1, height = bottom - top + 1;
    return std::max(width, height) <= kMostElongated * std::min(width, height) + 1.0;
  }
};

/// Groups the pixels above a threshold that touch each other. Spots at the border are left out.
std::vector<Spot> spotsAbove(const Plane& plane, float threshold, float sign) {
  std::vector<std::uint8_t> isOpen(plane.levels.size());
  for (std::size_t i = 0; i < isOpen.size(); ++i) isOpen[i] = sign * plane.levels[i] > threshold;
  std::vector<Spot> spots;
  std::vector<int> edge;
  for (int begin = 0; begin < static_cast<int>(isOpen.size()); ++begin) {
    if (isOpen[static_cast<std::size_t>(begin)] == 0) continue;
    Spot spot{.left = plane.width, .top = plane.height};
    edge.assign(1, begin);
    isOpen[static_cast<std::size_t>(begin)] = 0;
    while (!edge.empty()) {
      const int at = edge.back(), x = at % plane.width, y = at / plane.width;
      edge.pop_back();
      spot.area += 1.0;
      spot.u += x;
      spot.v += y;
      spot.left = std::min(spot.left, x), spot.right = std::max(spot.right, x);
      spot.top = std::min(spot.top, y), spot.bottom = std::max(spot.bottom, y);
      const auto visit = [&](int next) {
        if (isOpen[static_cast<std::size_t>(next)] == 0) return;
        isOpen[static_cast<std::size_t>(next)] = 0;
        edge.push_back(next);
      };
      if (x > 0) visit(at - 1);
      if (x + 1 < plane.width) visit(at + 1);
      if (y > 0) visit(at - plane.width);
      if (y + 1 < plane.height) visit(at + plane.width);
    }
    if (spot.left == 0 || spot.top == 0 || spot.right + 1 == plane.width || spot.bottom + 1 == plane.height) continue;
    spot.u /= spot.area, spot.v /= spot.area;
    spots.push_back(spot);
  }
  return spots;
}

/// Returns the value below which a share of all are.
/// \param values not empty
template <typename Number>
Number quantile(std::vector<Number> values, double share) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// Keeps the spots of the usual size and shape.
std::vector<Spot> alike(const std::vector<Spot>& spots) {
  std::vector<double> areas;
  for (const Spot& spot : spots) {
    if (spot.area >= 3.0 && spot.isRound()) areas.push_back(spot.area);
  }
  std::vector<Spot> kept;
  if (areas.size() < kFewest) return kept;
  const double usual = quantile(areas, 0.5);
  std::copy_if(spots.begin(), spots.end(), std::back_inserter(kept), [usual](const Spot& spot) {
    return spot.isRound() && spot.area < kMostAreas * usual && usual < kMostAreas * spot.area;
  });
  return kept;
}

/// Returns the median distance from a spot to the nearest one. Spots are sorted by rows, so that few are compared.
double pitchOf(std::vector<Spot> spots) {
  std::sort(spots.begin(), spots.end(), [](const Spot& one, const Spot& other) { return one.v < other.v; });
  std::vector<double> nearest;
  for (std::size_t i = 0; i < spots.size(); ++i) {
    double least = INFINITY;
    const auto compare = [&](const Spot& other) {
      least = std::min(least, std::hypot(other.u - spots[i].u, other.v - spots[i].v));
    };
    for (std::size_t j = i + 1; j < spots.size() && spots[j].v - spots[i].v < least; ++j) compare(spots[j]);
    for (std::size_t j = i; j-- > 0 && spots[i].v - spots[j].v < least;) compare(spots[j]);
    nearest.push_back(least);
  }
  return quantile(nearest, 0.5);
}

/// Returns the median difference of neighbours in a row: mostly noise, as markers cover a small part of the picture.
float noiseOf(const Plane& plane) {
  std::vector<float> steps;
  for (std::size_t i = 0; i + 1 < plane.levels.size(); i += 2) {
    steps.push_back(std::abs(plane.levels[i + 1] - plane.levels[i]));
  }
  return quantile(steps, 0.5);
}

/// Enters the markers of a channel if they stand out better than those that were entered before.
/// \param sign 1: they are brighter than what surrounds them, -1: darker
/// \param best contrast of those before
void seekMarkers(const Plane& contrast, float sign, double pixel, float& best, Look& look) {
  std::vector<float> all;
  for (const float level : contrast.levels) {
    if (sign * level > 0.0F) all.push_back(sign * level);
  }
  if (all.size() < 100) return;
  const float strongest = quantile(all, 0.995);
  if (strongest < std::max(kFaintest, best) || strongest < kOverNoise * noiseOf(contrast)) return;
  const std::vector<Spot> spots = alike(spotsAbove(contrast, 0.5F * strongest, sign));
  if (spots.size() < kFewest) return;
  best = strongest;
  std::vector<double> areas;
  for (const Spot& spot : spots) areas.push_back(spot.area);
  look.markers = static_cast<int>(spots.size());
  look.diameter_px = pixel * 2.0 * std::sqrt(quantile(areas, 0.5) / std::numbers::pi);
  look.pitch_px = pixel * pitchOf(spots);
}

/// Returns differences of neighbours, and the levels' variance, over all channels.
double sharpnessOf(const Snapshot& snapshot) {
  const std::size_t across = snapshot.channels, down = std::size_t{snapshot.width} * across;
  const std::vector<std::uint8_t>& levels = snapshot.levels;
  double steps = 0.0, sum = 0.0, squares = 0.0;
  const std::size_t end = levels.size() > down + across ? levels.size() - down - across : 0;
  for (std::size_t i = 0; i < end; ++i) {
    const double right = levels[i + across] - levels[i], below = levels[i + down] - levels[i];
    steps += right * right + below * below;
    sum += levels[i];
    squares += double{levels[i] * 1.0} * levels[i];
  }
  if (end == 0) return 0.0;
  const double count = static_cast<double>(end), variance = squares / count - (sum / count) * (sum / count);
  return variance > 1e-6 ? steps / count / variance : 0.0;
}

}  // namespace

Look lookAt(const Snapshot& snapshot) {
  Look look;
  std::array<std::size_t, 256> counts{};
  for (const std::uint8_t level : snapshot.levels) ++counts[level];
  const auto all = static_cast<double>(snapshot.levels.size());
  if (snapshot.levels.empty() ||
      snapshot.levels.size() != std::size_t{snapshot.width} * snapshot.height * snapshot.channels)
    return look;
  std::size_t below = 0;
  for (std::size_t level = 0; level < counts.size(); ++level) {
    look.histogram[level * Look::kBins / counts.size()] += static_cast<std::uint32_t>(counts[level]);
    if (static_cast<double>(below) < 0.99 * all) look.bright = static_cast<double>(level) / 255.0;
    below += counts[level];
  }
  look.clipped = static_cast<double>(counts[255] + counts[254]) / all;
  look.sharpness = sharpnessOf(snapshot);
  float best = 0.0F;
  for (std::size_t channel = 0; channel < snapshot.channels; ++channel) {
    const Plane contrast = contrastOf(snapshot, channel);
    for (const float sign : {1.0F, -1.0F}) seekMarkers(contrast, sign, snapshot.reduced, best, look);
  }
  return look;
}

}  // namespace traction::view
