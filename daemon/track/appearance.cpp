#include "daemon/track/appearance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace tractiond::track {

namespace {

constexpr double kLeastBlur_px = 0.3, kMostBlur_px = 3.0, kTypicalBlur_px = 0.9;
constexpr double kBlurResolution_px = 0.01;  // a misfit of the blur by this much does not show
constexpr float kMostCrossTalk = 0.9F;

MarkerTemplate templateFor(const Plane& plane, double radius_px, double blur_px) {
  return {radius_px / plane.scale, blur_px / plane.scale};
}

}  // namespace

MarkerTemplate roughTemplate(const Plane& plane, double radius_px) {
  return templateFor(plane, radius_px, kTypicalBlur_px);
}

MarkerTemplate fittingTemplate(const Plane& plane, double radius_px, const CrossTalk& crossTalk,
                               std::span<const Guess> places) {
  std::vector<Centre> centres(places.size());
  const auto misfit = [&](double blur) {
    const MarkerTemplate marker = templateFor(plane, radius_px, blur);
    const double perSample = 1.0 / marker.used();
    fitCentres(plane, marker, crossTalk, places, centres);
    double sum = 0.0;
    int found = 0;
    for (const Centre& centre : centres) {
      if (!centre.found) continue;
      sum += centre.misfit + perSample * centre.blurred * centre.blurred;
      ++found;
    }
    // A template that finds fewer does not get away with it.
    return found > 0 ? sum / found * static_cast<double>(centres.size()) / found : std::numeric_limits<double>::max();
  };
  // Golden section: the misfit has one minimum.
  constexpr double kGolden = 0.6180339887498949;
  double low = kLeastBlur_px, high = kMostBlur_px;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double atA = misfit(a), atB = misfit(b);
  while (high - low > kBlurResolution_px) {
    if (atA < atB) {
      high = b;
      b = a;
      atB = atA;
      a = high - kGolden * (high - low);
      atA = misfit(a);
    } else {
      low = a;
      a = b;
      atA = atB;
      b = low + kGolden * (high - low);
      atB = misfit(b);
    }
  }
  return templateFor(plane, radius_px, 0.5 * (low + high));
}

float crossTalkInto(const Plane& own, const Plane& other, const MarkerTemplate& marker, std::span<const Guess> places) {
  std::vector<Centre> centres(places.size());
  fitCentres(own, marker, {}, places, centres);
  std::vector<float> shares;
  for (const Centre& centre : centres) {
    if (centre.found) shares.push_back(amplitudeAt(other, marker, centre.u, centre.v) / centre.amplitude);
  }
  if (shares.empty()) return 0.0F;
  const auto middle = shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2);
  std::nth_element(shares.begin(), middle, shares.end());
  return std::clamp(*middle, 0.0F, kMostCrossTalk);
}

}  // namespace tractiond::track
