// Computes, from an integral image, the mean of a box inside a marker minus the mean of a frame around it, for every
// place of a coarse grid. Local maxima above a share of the typical response of the picture's markers are guesses for
// the template fit. The fit refines them and rejects those that do not have the shape of a marker, are brighter in the
// other colour, or are duplicates.
#include "daemon/track/detection.h"

#include "daemon/track/direct_fit.h"

#include <cassert>
#include <cmath>

namespace tractiond::track {

namespace {

constexpr float kLeastContrast = 6.0F;  // [1/255 of the range]
constexpr float kWeakest = 0.35F;       // share of the response of the median marker
constexpr float kOtherColour = 0.6F;    // share of the amplitude in the marker's own colour
constexpr float kOddShape = 0.35F;      // rms misfit, share of the amplitude
constexpr int kSpotsPerMarker = 4;

/// Sizes of the detector: an inner box of 2 inner + 1 samples, inside the disc; a frame from `gap` to `outer` samples
/// from the centre; a grid of places that are `step` samples apart.
struct Boxes {
  explicit Boxes(const MarkerTemplate& marker)
      : inner(static_cast<int>(0.75 * marker.radius()))
      , gap(marker.half() - 1)
      , outer(marker.half() + 1)
      , step(inner + 1) {}
  int inner, gap, outer, step;
};

}  // namespace

float Detector::border_px(const Plane& plane, const MarkerTemplate& marker) {
  return plane.scale * clippedMargin(marker);
}

Detector::Detector(int width_px, int height_px, int markers)
    : markers_(markers)
    , integral_(static_cast<std::size_t>(width_px + 1) * static_cast<std::size_t>(height_px + 1))
    , response_(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px))
    , grid_(width_px, height_px, 8.0F, kSpotsPerMarker * markers) {
  const auto most = static_cast<std::size_t>(kSpotsPerMarker * markers);
  peaks_.reserve(2 * most);
  guesses_.reserve(most);
  centres_.resize(most);
  spots_.reserve(most);
}

// Sums may overflow with samples of 16 bits; their differences over a box are right nevertheless.
template <typename Sample>
void Detector::integrate(const Plane& plane) {
  const int pitch = plane.width + 1;
  std::fill_n(integral_.begin(), pitch, 0U);
  for (int y = 0; y < plane.height; ++y) {
    const auto* sample = reinterpret_cast<const Sample*>(plane.first + y * plane.stride);
    const std::uint32_t* above = integral_.data() + y * pitch + 1;
    std::uint32_t* sum = integral_.data() + (y + 1) * pitch;
    *sum++ = 0;
    std::uint32_t row = 0;
    for (int x = 0; x < plane.width; ++x) {
      row += sample[x * plane.step];
      sum[x] = above[x] + row;
    }
  }
}

void Detector::collectPeaks(const Plane& plane, const MarkerTemplate& marker) {
  const auto [inner, gap, outer, step] = Boxes(marker);
  const int pitch = plane.width + 1;
  struct Box {
    float sum, area;
  };
  const auto box = [&](int x, int y, int half) -> Box {  // the part that lies in the picture
    const int left = std::max(x - half, 0), right = std::min(x + half + 1, plane.width);
    const int above = std::max(y - half, 0), below = std::min(y + half + 1, plane.height);
    const std::uint32_t* top = integral_.data() + above * pitch;
    const std::uint32_t* bottom = integral_.data() + below * pitch;
    return {static_cast<float>(bottom[right] - bottom[left] - top[right] + top[left]),
            static_cast<float>((right - left) * (below - above))};
  };
  const float perSum = plane.sign * plane.gain, least = kLeastContrast * plane.unit;

  const int first = inner + (outer - inner) % step;
  const int columns = (plane.width - first - inner - 1) / step + 1,
            rows = (plane.height - first - inner - 1) / step + 1;
  peaks_.clear();
  if (plane.width <= 2 * outer || plane.height <= 2 * outer) return;
  for (int row = 0; row < rows; ++row) {
    const int y = first + row * step;
    for (int column = 0; column < columns; ++column) {
      const int x = first + column * step;
      const Box middle = box(x, y, inner), around = box(x, y, outer), hole = box(x, y, gap);
      response_[row * columns + column] =
          perSum / middle.area * middle.sum - perSum / (around.area - hole.area) * (around.sum - hole.sum);
    }
  }
  const auto stronger = [](const Peak& a, const Peak& b) { return a.response > b.response; };
  const auto isPeak = [&](int column, int row) {
    const float here = response_[row * columns + column];
    if (here < least) return false;
    for (int y = std::max(row - 1, 0); y <= std::min(row + 1, rows - 1); ++y) {
      for (int x = std::max(column - 1, 0); x <= std::min(column + 1, columns - 1); ++x) {
        const float there = response_[y * columns + x];
        const bool after = y > row || (y == row && x > column);  // of equal maxima the last one is used
        if (after ? here <= there : here < there) return false;
      }
    }
    return true;
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      if (!isPeak(column, row)) continue;
      if (peaks_.size() == peaks_.capacity()) {
        std::nth_element(peaks_.begin(), peaks_.begin() + static_cast<std::ptrdiff_t>(peaks_.size() / 2), peaks_.end(),
                         stronger);
        peaks_.resize(peaks_.size() / 2);
      }
      peaks_.push_back({response_[row * columns + column], first + column * step, first + row * step});
    }
  }
  std::sort(peaks_.begin(), peaks_.end(), stronger);
}

std::span<const Spot> Detector::find(const Plane& own, const Plane& other, const MarkerTemplate& marker) {
  assert((own.width + 1) * static_cast<std::size_t>(own.height + 1) <= integral_.size());
  if (own.wide) {
    integrate<std::uint16_t>(own);
  } else {
    integrate<std::uint8_t>(own);
  }
  collectPeaks(own, marker);
  spots_.clear();
  if (peaks_.empty()) return spots_;

  const std::size_t typical = std::min(peaks_.size() - 1, static_cast<std::size_t>(markers_ / 2));
  const float least = kWeakest * peaks_[typical].response;
  guesses_.clear();
  for (const Peak& peak : peaks_) {
    if (peak.response < least || guesses_.size() == guesses_.capacity()) break;
    guesses_.push_back({own.u0 + own.scale * static_cast<float>(peak.x),
                        own.v0 + own.scale * static_cast<float>(peak.y), 0.5F * least, false});
  }
  const std::span<Centre> centres = std::span(centres_).first(guesses_.size());
  fitCentres(own, marker, {}, guesses_, centres);

  grid_.clear();
  const float leastDistance = own.scale * static_cast<float>(marker.radius());
  for (const Centre& centre : centres) {
    if (!centre.found || centre.misfit > kOddShape * kOddShape * centre.amplitude * centre.amplitude) continue;
    const bool coloured = other.first != nullptr;
    if (coloured && amplitudeAt(other, marker, centre.u, centre.v) > kOtherColour * centre.amplitude) continue;
    bool again = false;
    grid_.near(centre.u, centre.v, leastDistance, [&](int i) {
      again = again || std::hypot(spots_[i].u - centre.u, spots_[i].v - centre.v) < leastDistance;
    });
    if (again) continue;
    grid_.add(static_cast<int>(spots_.size()), centre.u, centre.v);
    spots_.push_back({centre.u, centre.v, centre.amplitude});
  }
  return spots_;
}

}  // namespace tractiond::track
