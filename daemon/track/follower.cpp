// A picture is either followed or acquired.
//
// Following: each marker is searched at the place extrapolated from its last two places (by template steps), and then
// at its last place. Markers that are not found are searched where their neighbours suggest, from the rim of the found
// region inwards, so that a region that moves farther than the template can follow is found from its calm surroundings.
// Acquiring, at the start, after a gap and when most markers are lost: all spots of the picture are detected and
// labelled against the rest pose.
//
// Afterwards markers that contradict their neighbours, or lie behind a marker nearer to the camera, are rejected.
#include "daemon/track/follower.h"

#include "daemon/track/appearance.h"
#include "daemon/track/direct_fit.h"
#include "daemon/track/nominal.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

namespace tractiond::track {

namespace {

// Amplitudes relative to rest. A long step may lead to a place that is dimmer than an accepted marker (kDim).
constexpr float kCatch = 0.25F, kBright = 1.6F;
constexpr float kWander = 0.45F;          // largest distance from the expected place, share of the spacing
constexpr float kSlopeDeviations = 3.5F;  // of the slope of the surroundings from the known one
constexpr int kSearches = 64;             // wide searches per frame
constexpr double kLabelled = 0.3;         // share of a layer's markers that an acquisition must label
constexpr double kFollowed = 0.25;        // share of the present markers that the next frame can be followed from
constexpr double kAcquireBelow = 0.6;     // share of the present markers
constexpr int kAcquirePause = 4;          // frames between two acquisitions that find few markers

}  // namespace

FollowerWorkspace::FollowerWorkspace(const sensor::Sensor& sensor)
    : planes(sensor.layers)
    , detector(sensor.camera.width, sensor.camera.height, sensor.markerCount())
    , labeller(latticesOf(sensor), sensor.camera.width, sensor.camera.height, 4 * sensor.markerCount())
    , grid(sensor.camera.width, sensor.camera.height, 16.0F, sensor.markerCount()) {}

Follower::Follower(const sensor::Sensor& sensor, int zeroFrames, FollowerWorkspace& workspace)
    : workspace_(&workspace)
    , markers_(sensor.markerCount())
    , nominal_(nominalPlaces(sensor))
    , spacing_px_(smallestSpacing(nominal_, latticesOf(sensor)))
    , tears_(latticesOf(sensor))
    , errors_(markers_, spacing_px_, zeroFrames) {
  assert(trackable(sensor));
  const std::vector<Lattice> lattices = latticesOf(sensor);
  double deepest = 0.0;
  for (const sensor::MarkerLayer& layer : sensor.layers) deepest = std::max(deepest, layer.depth);
  for (std::size_t i = 0; i < lattices.size(); ++i) {
    const sensor::MarkerLayer& layer = sensor.layers[i];
    const bool second = lattices.size() == 2 && sensor.layers[1 - i].colour < layer.colour;
    const double radius_px = markerRadius(sensor, layer);
    layers_.push_back(
        {i, lattices[i], second ? 1 : 0, layer.depth >= deepest, Trust(lattices[i], spacing_px_), radius_px});
    layers_.back().spots.reserve(static_cast<std::size_t>(4 * markers_));
    reference_.appearance.layers.push_back({.markers = {}, .crossTalk = {}, .radius_px = radius_px});
  }
  const auto count = static_cast<std::size_t>(markers_);
  reference_.place_px = place_ = previous_ = labelPlace_ = nominal_;
  for (auto* vectors : {&velocity_, &displacement_, &increment_, &slope_}) vectors->resize(count);
  for (auto* flags :
       {&valid_, &wasValid_, &stepped_, &mixed_, &attempts_, &reference_.appearance.size, &labelled_, &slopeFrames_}) {
    flags->resize(count);
  }
  reference_.present.assign(count, 1);
  reference_.amplitude.resize(count);
  lostFor_.resize(count);
  lost_.reserve(count);
  guesses_.resize(count);
  centres_.resize(count);
}

bool Follower::findMarkers(bool discontinuity) {
  ++frames_;
  const Planes& planes = workspace_->planes;
  for (Layer& layer : layers_) {
    layer.plane = planes.own(layer.index);
    layer.otherPlane = planes.other(layer.index);
  }
  errors_.setUnit(layers_.front().plane.unit);
  if (!reference_.appearance.isKnown && following_) {
    learnAppearance(std::vector<std::uint8_t>(valid_));
    errors_.forgetShape();
    newAppearance_ = true;
  }
  searches_ = kSearches;
  acquireIn_ = std::max(0, acquireIn_ - 1);
  bool relabelled = false;
  if (discontinuity || !following_) {
    tears_.forget();
    torn_ = false;
    std::fill(valid_.begin(), valid_.end(), std::uint8_t{0});
    if (discontinuity || acquireIn_ == 0) relabelled = acquire();
  } else {
    follow();
    if (countValid() < kAcquireBelow * countWanted() && acquireIn_ == 0) relabelled = acquire();
  }
  following_ = countValid() >= kFollowed * countWanted();
  return relabelled;
}

void Follower::fit(const Layer& layer, std::span<const Guess> guesses, std::span<Centre> centres) const {
  fitCentres(layer.plane, appearanceOf(layer).markers, appearanceOf(layer).crossTalk, guesses, centres);
}

/// Fits the guesses of all markers.
void Follower::fitGuesses() {
  std::fill(valid_.begin(), valid_.end(), std::uint8_t{0});
  std::fill(stepped_.begin(), stepped_.end(), std::uint8_t{0});
  for (const Layer& layer : layers_) {
    const auto first = static_cast<std::size_t>(layer.lattice.first),
               count = static_cast<std::size_t>(layer.lattice.count());
    fit(layer, std::span(guesses_).subspan(first, count), std::span(centres_).subspan(first, count));
    for (int i = layer.lattice.first; i < layer.lattice.first + layer.lattice.count(); ++i) {
      noteSlope(layer, i, centres_[i]);
      accept(i, centres_[i], {guesses_[i].u, guesses_[i].v});
    }
  }
}

int Follower::countValid() const {
  return static_cast<int>(std::count(valid_.begin(), valid_.end(), 1));
}

int Follower::countWanted() const {
  return static_cast<int>(std::count(reference_.present.begin(), reference_.present.end(), 1));
}

bool Follower::acquire() {
  acquireIn_ = kAcquirePause;
  std::array<std::span<const Spot>, 2> spots;
  LabelOptions options{.seenBefore = reference_.isZero, .least = kLabelled};
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    Layer& layer = layers_[i];
    Appearance::Layer& appearance = appearanceOf(layer);
    if (appearance.markers.empty()) appearance.markers = {roughTemplate(layer.plane, appearance.radius_px)};
    const MarkerTemplate& marker = reference_.appearance.isKnown ? appearance.markers.front() : roughOf(layer);
    const auto found = workspace_->detector.find(layer.plane, layer.otherPlane, marker);
    options.border_px = std::max(options.border_px, Detector::border_px(layer.plane, marker));
    layer.spots.assign(found.begin(), found.end());
    spots[i] = layer.spots;
  }
  if (!workspace_->labeller.label(std::span(spots).first(layers_.size()),
                                  reference_.isZero ? reference_.place_px : nominal_, options, labelPlace_,
                                  labelled_)) {
    return false;
  }
  for (std::size_t i = 0; i < layers_.size(); ++i) layers_[i].seen = workspace_->labeller.seen()[i];
  place_ = labelPlace_;
  placeUnlabelled();
  previous_ = place_;
  valid_ = labelled_;
  std::fill(wasValid_.begin(), wasValid_.end(), std::uint8_t{0});
  std::fill(velocity_.begin(), velocity_.end(), Vector{});
  const bool learnsShapes = !reference_.isZero || (!reference_.appearance.isKnown && seeksAll_);
  if (!reference_.appearance.isKnown) learnAppearance(labelled_);
  if (!reference_.isZero) assumeRest();
  markOverlaps();
  valid_.swap(labelled_);
  for (int i = 0; i < markers_; ++i) {
    const bool seek = labelled_[i] && wanted(i);
    slopeFrames_[i] = 0;
    slope_[i] = {};
    guesses_[i] = seek ? guessAt(i, place_[i]) : Guess{-1.0F};
  }
  errors_.forgetShape();
  fitGuesses();
  errors_.learnShape(centres_, valid_);
  if (learnsShapes) errors_.learnOwnShapes(centres_, valid_);
  newAppearance_ = false;
  finishFrame(true);
  if (countValid() >= kAcquireBelow * countWanted()) acquireIn_ = 0;
  return true;
}

void Follower::follow() {
  const bool wasTorn = std::exchange(torn_, false);
  previous_ = place_;
  wasValid_ = valid_;
  for (int i = 0; i < markers_; ++i) {
    guesses_[i] = wanted(i) ? guessAt(i, place_[i] + velocity_[i]) : Guess{-1.0F};
  }
  fitGuesses();
  for (const Layer& layer : layers_) {
    for (int i = layer.lattice.first; i < layer.lattice.first + layer.lattice.count(); ++i) {
      if (valid_[i] || !wanted(i)) continue;
      if (velocity_[i].squared() > 1.0F && fitAt(layer, i, previous_[i])) continue;  // it may have stopped
      // Markers that the torn frame displaced are again where the last intact frame had them.
      if (wasTorn && wasValid_[i] && tears_.referenceValid()[i])
        fitAt(layer, i, reference_.place_px[i] + tears_.reference_px()[i]);
    }
  }
  if (std::exchange(newAppearance_, false)) {
    errors_.learnShape(centres_, valid_);
    if (seeksAll_ || !reference_.isZero) errors_.learnOwnShapes(centres_, valid_);
  }
  finishFrame(false);
}

void Follower::finishFrame(bool thorough) {
  recover();
  markOverlaps();
  struct Fits final : CentreErrors::DeformedFits {
    Fits(Follower& own, const Layer& its)
        : follower(own)
        , layer(its) {}
    bool adopt(int marker, float mostMisfit) override { return follower.adoptDeformed(layer, marker, mostMisfit); }
    Follower& follower;
    const Layer& layer;
  };
  for (Layer& layer : layers_) {
    Fits deformed(*this, layer);
    errors_.weigh(layer.lattice, appearanceOf(layer).markers.front().used(), centres_, displacement_,
                  reference_.amplitude, slopeFrames_, deformed, valid_);
  }
  for (int i = 0; i < markers_; ++i) stepped_[i] = stepped_[i] && valid_[i];
  torn_ = tears_.torn(displacement_, errors_.variance_px2(), valid_) || torn_;
  for (int i = 0; i < markers_; ++i) thorough = thorough || valid_[i] != wasValid_[i];
  for (Layer& layer : layers_) layer.trust.prune(displacement_, valid_, thorough);
  learnSlopes();
  guessLost();
}

/// Fits the disc of a marker as an ellipse of any size. If its misfit is at most `mostMisfit`, takes its centre as that
/// of the marker and returns true.
bool Follower::adoptDeformed(const Layer& layer, int marker, float mostMisfit) {
  Centre centre = centres_[marker];
  const MarkerTemplate& disc = appearanceOf(layer).markers[reference_.appearance.size[marker]];
  if (!fitDeformedCentre(layer.plane, disc, appearanceOf(layer).crossTalk, guessAt(marker, place_[marker]), centre))
    return false;
  if (centre.misfit > mostMisfit) return false;
  return accept(marker, centre, place_[marker]);
}

Guess Follower::guessAt(int marker, Vector place) const {
  return {place.u,
          place.v,
          kCatch * reference_.amplitude[marker],
          mixed_[marker] != 0,
          reference_.appearance.size[marker],
          slope_[marker].u,
          slope_[marker].v};
}

/// Corrects the centre for a reflection beside the marker, which would shift it. The slope of the surroundings is known
/// from the frames before; if this window has a different one, that is used, with less precision.
void Follower::noteSlope(const Layer& layer, int marker, Centre& centre) {
  if (!centre.found) return;
  const Vector seen{centre.slopeU, centre.slopeV};
  const float frames = slopeFrames_[marker];
  const float limit2 = kSlopeDeviations * kSlopeDeviations * errors_.noise() * errors_.noise() * centre.slopeVariance;
  if (frames < 1.0F || (seen - slope_[marker]).squared() > limit2 * (1.0F + 1.0F / frames)) {
    slope_[marker] = seen;
    slopeFrames_[marker] = 0;
    const Guess guess = guessAt(marker, {centre.u, centre.v});
    fit(layer, {&guess, 1}, {&centre, 1});
  }
  centre.slopeShare /= std::max<float>(slopeFrames_[marker], 1.0F);
}

void Follower::learnSlopes() {
  for (int i = 0; i < markers_; ++i) {
    if (!valid_[i]) {
      slopeFrames_[i] = 0;
      continue;
    }
    const Vector seen{centres_[i].slopeU, centres_[i].slopeV};
    slopeFrames_[i] = std::min<std::uint8_t>(slopeFrames_[i] + 1, 2 * CentreErrors::kMemory - 1);
    slope_[i] = slope_[i] + CentreErrors::weightOf(slopeFrames_[i]) * (seen - slope_[i]);
  }
}

bool Follower::accept(int marker, const Centre& centre, Vector expected) {
  if (!centre.found) return false;
  const float rest = reference_.amplitude[marker], amplitude = centre.amplitude;
  if (!(amplitude >= kDim * rest && amplitude <= kBright * rest)) return false;
  if (!errors_.isMarker(marker, centre)) return false;
  const Vector place{centre.u, centre.v};
  if ((place - expected).squared() > kWander * kWander * spacing_px_ * spacing_px_) return false;
  centres_[marker] = centre;
  place_[marker] = place;
  displacement_[marker] = place - reference_.place_px[marker];
  increment_[marker] = place - previous_[marker];
  valid_[marker] = 1;
  stepped_[marker] = wasValid_[marker];
  return true;
}

bool Follower::fitAt(const Layer& layer, int marker, Vector place) {
  const Guess guess = guessAt(marker, place);
  Centre centre;
  fit(layer, {&guess, 1}, {&centre, 1});
  noteSlope(layer, marker, centre);
  return accept(marker, centre, place);
}

bool Follower::latticesFit() const {
  for (const Layer& layer : layers_) {
    const LatticeSeen& seen = layer.seen;
    const Lattice& lattice = layer.lattice;
    const auto isWhole = [&](const LatticeSeen& one) {
      return one.columns == lattice.columns && one.rows == lattice.rows;
    };
    if (seen.columns != 0 && !isWhole(seen) && !isWhole(extentWith(seen, lattice, valid_))) return false;
  }
  return true;
}

}  // namespace tractiond::track
