#include "daemon/track/appearance.h"

#include "base/quantile.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <vector>

namespace tractiond::track {

namespace {

constexpr double kLeastBlur_px = 0.3, kMostBlur_px = 3.0, kTypicalBlur_px = 0.9;
constexpr double kBlurResolution_px = 0.01;  // an error of the blur below this is not visible
constexpr float kMostCrossTalk = 0.9F;
constexpr double kSizeStep = 1.05;
constexpr int kLeastStep = -20, kMostStep = 12;  // discs of 0.38 and of 1.8 times the size
constexpr int kPatience = 4;                     // steps without improvement before the search ends
constexpr float kBetterMisfit = 0.85F;           // relative to the size before; a smaller improvement is noise
constexpr int kSizeRounds = 2;
constexpr std::size_t kPlaces = 300;  // that determine the blur
constexpr double kOddShape = 0.03;    // rms misfit, share of the amplitude: more than weak noise causes
constexpr double kFarBetter = 0.5;

MarkerTemplate templateFor(const Plane& plane, double radius_px, double blur_px) {
  return {radius_px / plane.scale, blur_px / plane.scale};
}

float unexplained(const MarkerTemplate& marker, const Centre& centre) {
  return centre.misfit + centre.blurred * centre.blurred / static_cast<float>(marker.used());
}

struct BlurFit {
  double blur_px = 0.0;
  double misfit = std::numeric_limits<double>::max();  ///< mean square [levels^2]
  double amplitude2 = 0.0;                             ///< mean square [levels^2]
};

BlurFit fittingBlur(const Plane& plane, double radius_px, const CrossTalk& crossTalk, std::span<const Guess> places) {
  std::vector<Centre> centres(places.size());
  const auto fit = [&](double blur) {
    const MarkerTemplate marker = templateFor(plane, radius_px, blur);
    fitCentres(plane, marker, crossTalk, places, centres);
    double sum = 0.0, squares = 0.0;
    int found = 0;
    for (const Centre& centre : centres) {
      if (!centre.found) continue;
      sum += unexplained(marker, centre);
      squares += centre.amplitude * centre.amplitude;
      ++found;
    }
    if (found == 0) return BlurFit{blur};
    // Scales the misfit, so that a template with which fewer centres are found is not preferred.
    return BlurFit{blur, sum / found * static_cast<double>(centres.size()) / found, squares / found};
  };
  // Golden-section search: the misfit has one minimum.
  constexpr double kGolden = 0.6180339887498949;
  double low = kLeastBlur_px, high = kMostBlur_px;
  BlurFit a = fit(high - kGolden * (high - low)), b = fit(low + kGolden * (high - low));
  while (high - low > kBlurResolution_px) {
    if (a.misfit < b.misfit) {
      high = b.blur_px;
      b = a;
      a = fit(high - kGolden * (high - low));
    } else {
      low = a.blur_px;
      a = b;
      b = fit(low + kGolden * (high - low));
    }
  }
  BlurFit best = a.misfit < b.misfit ? a : b;
  best.blur_px = 0.5 * (low + high);
  return best;
}

/// Returns the fit with the radius of the discs, and sets `radius_px` to it if it has a much smaller misfit.
BlurFit fittingRadius(const Plane& plane, double& radius_px, const CrossTalk& crossTalk,
                      std::span<const Guess> places) {
  BlurFit best = fittingBlur(plane, radius_px, crossTalk, places);
  if (best.misfit < kOddShape * kOddShape * best.amplitude2) return best;
  double least = kFarBetter * best.misfit;
  const double described_px = radius_px;
  for (const double share : {0.6, 0.7, 0.84, 1.19, 1.4, 1.6}) {
    const BlurFit other = fittingBlur(plane, share * described_px, crossTalk, places);
    if (other.misfit >= least) continue;
    best = other;
    least = other.misfit;
    radius_px = share * described_px;
  }
  return best;
}

/// Sets steps of size that are far beyond most others to 0: such markers are not larger, but have dust on them.
void forgetDust(std::span<int> steps) {
  std::vector<int> sizes;
  for (const int step : steps) sizes.push_back(std::abs(step));
  if (sizes.empty()) return;
  const int limit = 3 * quantile(sizes, 0.9);
  for (int& step : steps) {
    if (std::abs(step) > limit) step = 0;
  }
}

/// Returns evenly chosen elements, kPlaces at most.
std::vector<Guess> someOf(std::span<const Guess> all) {
  std::vector<Guess> some;
  for (std::size_t i = 0; i < all.size(); i += all.size() / kPlaces + 1) some.push_back(all[i]);
  return some;
}

/// Returns by how many steps of size each disc is larger than one of `radius_px`. Tries one step after another, up and
/// down, until kPatience of them fit no better.
std::vector<int> stepsOfSize(const Plane& plane, double radius_px, double blur_px, const CrossTalk& crossTalk,
                             std::span<const Guess> places) {
  std::vector<int> steps(places.size(), 0);
  constexpr float kNothing = std::numeric_limits<float>::max();
  std::vector<float> least(places.size(), kNothing);
  std::vector<std::size_t> climbing(places.size());
  std::vector<Guess> guesses;
  std::vector<Centre> centres;
  const auto fit = [&](int step) {
    const MarkerTemplate marker = templateFor(plane, radius_px * std::pow(kSizeStep, step), blur_px);
    guesses.clear();
    for (const std::size_t i : climbing) guesses.push_back(places[i]);
    centres.resize(guesses.size());
    fitCentres(plane, marker, crossTalk, guesses, centres);
    for (std::size_t k = 0; k < climbing.size(); ++k) {
      const std::size_t i = climbing[k];
      const float left = centres[k].found ? unexplained(marker, centres[k]) : kNothing;
      if (left < (step == 0 ? 1.0F : kBetterMisfit) * least[i]) {
        least[i] = left;
        steps[i] = step;
      }
    }
    std::erase_if(climbing,
                  [&](std::size_t i) { return least[i] < kNothing && std::abs(steps[i] - step) >= kPatience; });
  };
  std::iota(climbing.begin(), climbing.end(), std::size_t{0});
  fit(0);
  for (const int direction : {1, -1}) {
    climbing.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (steps[i] == 0) climbing.push_back(i);
    }
    for (int step = direction; step >= kLeastStep && step <= kMostStep && !climbing.empty(); step += direction) {
      fit(step);
    }
  }
  return steps;
}

}  // namespace

MarkerTemplate roughTemplate(const Plane& plane, double radius_px) {
  return templateFor(plane, radius_px, kTypicalBlur_px);
}

std::vector<std::uint8_t> fitSizes(const Plane& plane, Appearance::Layer& layer, std::span<const Guess> places,
                                   std::span<const std::uint8_t> seen) {
  const CrossTalk& crossTalk = layer.crossTalk;
  double& radius_px = layer.radius_px;
  std::vector<Guess> typical;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (seen[i]) typical.push_back(places[i]);
  }
  double blur = fittingRadius(plane, radius_px, crossTalk, someOf(typical)).blur_px;
  std::vector<int> steps;
  for (int round = 1;; ++round) {
    steps = stepsOfSize(plane, radius_px, blur, crossTalk, places);
    forgetDust(steps);
    std::vector<int> sorted;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (seen[i]) sorted.push_back(steps[i]);
    }
    if (round == kSizeRounds || std::ranges::all_of(sorted, [](int step) { return step == 0; })) break;
    // Discs of medium size determine the blur better than all of them.
    const int middle = quantile(sorted);
    typical.clear();
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (seen[i] && steps[i] == middle) typical.push_back(places[i]);
    }
    radius_px *= std::pow(kSizeStep, middle);
    blur = fittingBlur(plane, radius_px, crossTalk, someOf(typical)).blur_px;
  }
  layer.markers = {templateFor(plane, radius_px, blur)};
  std::vector<std::uint8_t> sizes;
  std::map<int, std::uint8_t> known = {{0, 0}};
  for (const int step : steps) {
    const auto [place, isNew] = known.try_emplace(step, static_cast<std::uint8_t>(layer.markers.size()));
    if (isNew) layer.markers.push_back(templateFor(plane, radius_px * std::pow(kSizeStep, step), blur));
    sizes.push_back(place->second);
  }
  return sizes;
}

float crossTalkInto(const Plane& own, const Plane& other, const MarkerTemplate& marker, std::span<const Guess> places) {
  std::vector<Centre> centres(places.size());
  fitCentres(own, marker, {}, places, centres);
  std::vector<float> shares;
  for (const Centre& centre : centres) {
    if (centre.found) shares.push_back(amplitudeAt(other, marker, centre.u, centre.v) / centre.amplitude);
  }
  if (shares.empty()) return 0.0F;
  return std::clamp(quantile(shares), 0.0F, kMostCrossTalk);
}

}  // namespace tractiond::track
