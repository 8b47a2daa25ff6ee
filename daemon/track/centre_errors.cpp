#include "daemon/track/centre_errors.h"

#include "base/quantile.h"

#include <algorithm>
#include <cmath>

namespace tractiond::track {
namespace {

constexpr float kTypicalNoise = 3.0F;  // [1/255 of the range], until it is measured
// Largest misfit of a marker: rms as a share of the amplitude, beyond twice the noise and the misfit of this marker, or
// of the typical one, at rest.
constexpr float kOddShape = 0.16F, kNoiseDeviations = 2.0F, kMostShape = 0.15F;
constexpr double kTypical = 0.75;      // share of the markers with a smaller misfit than the typical one
constexpr float kMostOwnShape = 2.0F;  // largest shape of a marker, relative to the typical one
// A disc with the strain s has a misfit of 0.22 s. If the misfit exceeds that by x times the variance of the noise, the
// squared error of the centre is 1 + 6 x times that by noise alone (measured with dust of 0.4 to 3 px at all places).
// The excess is used where noise alone would hardly cause it; a marker with too large an excess is rejected.
constexpr float kOddPerStrain = 0.25F, kLeastStrain = 0.03F, kMostStrain = 0.45F;
constexpr float kErrorPerExcess = 6.0F, kSignificant = 3.0F, kMostExcess = 2.0F;
constexpr int kMostDeformedFits = 64;  // fits of deformed discs per frame and layer, as they take time
constexpr float kLeastNoise2 = 0.25F;  // share of the variance at rest: lower limit for dark markers

}  // namespace

CentreErrors::CentreErrors(int markers, float spacing_px, int zeroFrames)
    : spacing_px_(spacing_px)
    , perZeroFrame_(1.0F / static_cast<float>(zeroFrames))
    , noise_(kTypicalNoise)
    , shape_(static_cast<std::size_t>(markers))
    , excess_(shape_.size())
    , variance_(excess_.size()) {
  shares_.reserve(excess_.size());
}

void CentreErrors::adopt(const RestPose& pose) {
  noise_ = pose.noise;
  shotNoise_ = pose.shotNoise;
  light_ = pose.light;
  measured_ = true;
  if (pose.oddity.size() == shape_.size()) {
    shape_ = pose.oddity;
  } else {
    std::fill(shape_.begin(), shape_.end(), 0.0F);
  }
}

void CentreErrors::learnOwnShapes(std::span<const Centre> centres, std::span<const std::uint8_t> valid) {
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if (!valid[i]) continue;
    const float excess = std::max(centres[i].misfit - noise_ * noise_, 0.0F);
    shape_[i] = std::min(std::sqrt(excess) / centres[i].amplitude, kMostOwnShape * kMostShape);
  }
}

void CentreErrors::setUnit(float unit) {
  if (!measured_) noise_ = kTypicalNoise * unit;
}

void CentreErrors::learnShape(std::span<const Centre> centres, std::span<const std::uint8_t> valid) {
  shares_.clear();
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if (!valid[i]) continue;
    const float excess = std::max(centres[i].misfit - noise_ * noise_, 0.0F);
    shares_.push_back(excess / (centres[i].amplitude * centres[i].amplitude));
  }
  if (shares_.empty()) return;
  typicalShape_ = std::min(std::sqrt(quantile(shares_, kTypical)), kMostShape);
}

void CentreErrors::forgetShape() {
  typicalShape_ = kMostShape;
}

/// Returns the shape of a marker, but at least the typical one, so that most markers do not depend on how well their
/// own is known; and at most twice that, as a larger one is caused by dust, which stays in place while the marker
/// moves.
float CentreErrors::shapeOf(int marker) const {
  return std::clamp(shape_[static_cast<std::size_t>(marker)], typicalShape_, kMostOwnShape * typicalShape_);
}

bool CentreErrors::isMarker(int marker, const Centre& centre) const {
  const float noise = kNoiseDeviations * noise_;
  const float shape = (shapeOf(marker) + kOddShape) * centre.amplitude;
  return centre.misfit <= noise * noise + shape * shape;
}

float CentreErrors::weightOf(int n) {
  return 1.0F / static_cast<float>(std::min(n, kMemory));
}

/// Returns the strain at a marker by the displacements of its neighbours.
float CentreErrors::strainAt(const Lattice& lattice, int marker, std::span<const Vector> displacement,
                             std::span<const std::uint8_t> valid) const {
  const int column = (marker - lattice.first) % lattice.columns, row = (marker - lattice.first) / lattice.columns;
  float square = 0.0F;
  for (const auto& [x, y] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
    if (!lattice.has(column + x, row + y)) continue;
    const int neighbour = lattice.at(column + x, row + y);
    if (valid[neighbour]) square = std::max(square, (displacement[neighbour] - displacement[marker]).squared());
  }
  return std::min(std::sqrt(square) / spacing_px_, kMostStrain);
}

void CentreErrors::weigh(const Lattice& lattice, int pixels, std::span<const Centre> centres,
                         std::span<const Vector> displacement, std::span<const float> restAmplitude,
                         std::span<const std::uint8_t> frames, DeformedFits& deformed, std::span<std::uint8_t> valid) {
  int deformedFits = 0;
  const float significant = kSignificant * std::sqrt(2.0F / static_cast<float>(pixels - 7));
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
    if (!valid[i]) continue;
    const Centre& centre = centres[i];
    const float noise2 =
        std::max(noise_ * noise_ + shotNoise_ * (centre.level - light_), kLeastNoise2 * noise_ * noise_);
    float shape = shapeOf(i) * centre.amplitude;
    float excess = (centre.misfit - shape * shape) / noise2 - 1.0F;
    if (excess > significant) {
      const float atRest = shape, strain = strainAt(lattice, i, displacement, valid);
      shape += kOddPerStrain * strain * centre.amplitude;
      excess = std::max((centre.misfit - shape * shape) / noise2 - 1.0F, 0.0F);
      // Large strained discs have a larger misfit. Dust and tears do not look like an ellipse.
      const float explained = atRest * atRest + (1.0F + 0.5F * significant) * noise2;
      if (excess > significant && strain > kLeastStrain && deformedFits++ < kMostDeformedFits &&
          deformed.adopt(i, explained)) {
        excess = 0.0F;
      }
    }
    // Uses the excess of this frame if it is significant, else the mean over the frames.
    excess_[i] += weightOf(frames[i] + 1) * (excess - excess_[i]);
    if (excess < significant) {
      excess = excess_[i] * std::sqrt(static_cast<float>(frames[i] + 1)) > significant ? excess_[i] : 0.0F;
    }
    if (excess > kMostExcess) {
      valid[i] = 0;
      continue;
    }
    const float doubt = 1.0F + kErrorPerExcess * excess;
    // Adds the error of the rest position: the variance at the amplitude of the rest frames, divided by their number.
    const float amplitude = centre.amplitude / std::max(restAmplitude[i], 1.0F);
    variance_[i] = noise2 * (centre.variance + centre.slopeShare) * doubt +
                   noise_ * noise_ * centre.variance * perZeroFrame_ * amplitude * amplitude;
  }
}

}  // namespace tractiond::track
