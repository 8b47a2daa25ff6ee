// A frame is followed or acquired.
//
// Following: each marker is sought where its last two places say (template steps from there), a second time where it
// last was. What is not found is sought where its neighbours say, from the rim of what is found inwards, so that a
// region that jumps farther than the template's catch is found from its calm surroundings. Acquiring, at the start,
// after a gap and when most is lost: all spots of the picture are detected and labelled against the rest pose.
//
// Then nothing is believed that contradicts its neighbours, nor what lies behind a marker nearer to the camera.
#include "daemon/track/tracker.h"

#include "daemon/track/appearance.h"
#include "daemon/track/direct_fit.h"
#include "daemon/track/nominal.h"
#include "daemon/track/rest_pose.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace tractiond::track {

namespace {

// Amplitudes relative to rest. A step from afar may lead to a place that is dimmer than what is believed (kDim).
constexpr float kCatch = 0.25F, kBright = 1.6F;
constexpr float kWander = 0.45F;          // of the spacing, from where a marker was expected
constexpr float kSlopeDeviations = 3.5F;  // of the seen slope of the surroundings from the known one
constexpr int kSearches = 64;             // wide ones per frame
constexpr double kLabelled = 0.3;          // of a layer, for an acquisition to count
constexpr double kFollowed = 0.25;         // of the present markers, for the next frame to be followed
constexpr double kAcquireBelow = 0.6;      // of the present markers
constexpr int kAcquirePause = 4;           // frames between two tries that help little
constexpr int kAgreeingFrames = 10;
constexpr double kAgreement = 3.0;  // deviations

RestPose emptyPose(int markers) {
  RestPose pose;
  pose.position_px.resize(2 * static_cast<std::size_t>(markers));
  pose.amplitude.resize(static_cast<std::size_t>(markers));
  pose.present.resize(static_cast<std::size_t>(markers));
  pose.oddity.resize(static_cast<std::size_t>(markers));
  return pose;
}

}  // namespace

Tracker::Tracker(const sensor::Sensor& sensor, const TrackOptions& options)
    : options_(options)
    , markers_(sensor.markerCount())
    , planes_(sensor.layers)
    , nominal_(nominalPlaces(sensor))
    , spacing_px_(smallestSpacing(nominal_, latticesOf(sensor)))
    , detector_(sensor.camera.width, sensor.camera.height, markers_)
    , labeller_(latticesOf(sensor), sensor.camera.width, sensor.camera.height, 4 * markers_)
    , grid_(sensor.camera.width, sensor.camera.height, 16.0F, markers_)
    , tears_(latticesOf(sensor))
    , errors_(markers_, spacing_px_, options.zeroFrames)
    , taker_(markers_, options.zeroFrames, options.minValidFraction)
    , pixelNoise_(markers_)
    , pose_(emptyPose(markers_))
    , finished_(emptyPose(markers_))
    , decisions_({emptyPose(markers_)})
    , decision_({emptyPose(markers_)}) {
  inputs_.zero = pose_;
  assert(trackable(sensor));
  const std::vector<Lattice> lattices = latticesOf(sensor);
  double deepest = 0.0;
  for (const sensor::MarkerLayer& layer : sensor.layers) deepest = std::max(deepest, layer.depth);
  for (std::size_t i = 0; i < lattices.size(); ++i) {
    const sensor::MarkerLayer& layer = sensor.layers[i];
    const bool second = lattices.size() == 2 && sensor.layers[1 - i].colour < layer.colour;
    layers_.push_back({i, lattices[i], second ? 1 : 0, markerRadius(sensor, layer), layer.depth >= deepest,
                       Trust(lattices[i], spacing_px_)});
    layers_.back().described_px = layers_.back().radius_px;
    layers_.back().spots.reserve(static_cast<std::size_t>(4 * markers_));
    sight_.layers[i].expected = lattices[i].count();
  }
  sight_.layerCount = static_cast<int>(lattices.size());
  const auto count = static_cast<std::size_t>(markers_);
  rest_ = place_ = previous_ = labelPlace_ = nominal_;
  for (auto* vectors : {&velocity_, &displacement_, &increment_, &slope_}) vectors->resize(count);
  for (auto* flags :
       {&valid_, &wasValid_, &stepped_, &mixed_, &attempts_, &size_, &sizeBefore_, &labelled_, &slopeFrames_}) {
    flags->resize(count);
  }
  present_.assign(count, 1);
  restAmplitude_.resize(count);
  lostFor_.resize(count);
  lost_.reserve(count);
  guesses_.resize(count);
  centres_.resize(count);
}

Outcome Tracker::track(const Frame& frame, MarkerField& field) {
  ++frames_;
  inputs_.clear();
  planes_.read(frame);
  for (Layer& layer : layers_) {
    layer.plane = planes_.own(layer.index);
    layer.otherPlane = planes_.other(layer.index);
  }
  errors_.setUnit(layers_.front().plane.unit);
  heedDecision();
  heedRequest();
  searches_ = kSearches;
  acquireIn_ = std::max(0, acquireIn_ - 1);
  bool relabelled = false;
  if (frame.info.discontinuity || !following_) {
    tears_.forget();
    torn_ = false;
  }
  if (frame.info.discontinuity || !following_) {
    std::fill(valid_.begin(), valid_.end(), std::uint8_t{0});
    if (frame.info.discontinuity || acquireIn_ == 0) relabelled = acquire();
  } else {
    follow();
    if (countValid() < kAcquireBelow * countWanted() && acquireIn_ == 0) relabelled = acquire();
  }
  following_ = countValid() >= kFollowed * countWanted();
  reportSight();

  heedVerdict();
  write(frame.info, relabelled, field);
  const bool tracked = haveRest_ && (!options_.awaitJudge || verdict_.zero == zero_);
  takeZero(frame.info);
  return tracked ? Outcome::kTracked : Outcome::kNoRestPose;
}

int Tracker::countValid() const {
  return static_cast<int>(std::count(valid_.begin(), valid_.end(), 1));
}

int Tracker::countWanted() const {
  return static_cast<int>(std::count(present_.begin(), present_.end(), 1));
}

bool Tracker::acquire() {
  acquireIn_ = kAcquirePause;
  std::array<std::span<const Spot>, 2> spots;
  LabelOptions options{.seenBefore = haveRest_, .least = kLabelled};
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    Layer& layer = layers_[i];
    const MarkerTemplate& marker = haveAppearance_ ? layer.markers.front() : roughOf(layer);
    const auto found = detector_.find(layer.plane, layer.otherPlane, marker);
    options.border_px = std::max(options.border_px, Detector::border_px(layer.plane, marker));
    layer.spots.assign(found.begin(), found.end());
    sight_.layers[i].spots = static_cast<int>(found.size());
    spots[i] = layer.spots;
  }
  if (!labeller_.label(std::span(spots).first(layers_.size()), haveRest_ ? rest_ : nominal_, options, labelPlace_,
                       labelled_)) {
    return false;
  }
  for (std::size_t i = 0; i < layers_.size(); ++i) sight_.layers[i].seen = labeller_.seen()[i];
  place_ = labelPlace_;
  placeUnlabelled();
  previous_ = place_;
  valid_ = labelled_;
  std::fill(wasValid_.begin(), wasValid_.end(), std::uint8_t{0});
  std::fill(velocity_.begin(), velocity_.end(), Vector{});
  const bool learnsShapes = !haveRest_ || (!haveAppearance_ && taking_ && takingRequested_);
  if (!haveAppearance_) learnAppearance(labelled_);
  if (!haveRest_) assumeRest();
  markOverlaps();
  valid_.swap(labelled_);
  std::fill(valid_.begin(), valid_.end(), std::uint8_t{0});
  std::fill(stepped_.begin(), stepped_.end(), std::uint8_t{0});
  for (int i = 0; i < markers_; ++i) {
    const bool seek = labelled_[i] && wanted(i);
    slopeFrames_[i] = 0;
    slope_[i] = {};
    guesses_[i] = seek ? guessAt(i, place_[i]) : Guess{-1.0F};
  }
  errors_.forgetShape();
  for (Layer& layer : layers_) {
    fitCentres(layer.plane, layer.markers, layer.crossTalk, ofLayer(guesses_, layer), ofLayer(centres_, layer));
    for (int i = layer.lattice.first; i < layer.lattice.first + layer.lattice.count(); ++i) {
      heedSlope(layer, i, centres_[i]);
      accept(i, centres_[i], {guesses_[i].u, guesses_[i].v});
    }
  }
  errors_.learnShape(centres_, valid_);
  if (learnsShapes) errors_.learnOwnShapes(centres_, valid_);
  newAppearance_ = false;
  finishFrame(true);
  if (countValid() >= kAcquireBelow * countWanted()) acquireIn_ = 0;
  return true;
}

void Tracker::follow() {
  const bool wasTorn = torn_;
  torn_ = false;
  previous_ = place_;
  wasValid_ = valid_;
  for (int i = 0; i < markers_; ++i) {
    guesses_[i] = wanted(i) ? guessAt(i, place_[i] + velocity_[i]) : Guess{-1.0F};
  }
  std::fill(valid_.begin(), valid_.end(), std::uint8_t{0});
  std::fill(stepped_.begin(), stepped_.end(), std::uint8_t{0});
  for (Layer& layer : layers_) {
    fitCentres(layer.plane, layer.markers, layer.crossTalk, ofLayer(guesses_, layer), ofLayer(centres_, layer));
    for (int i = layer.lattice.first; i < layer.lattice.first + layer.lattice.count(); ++i) {
      heedSlope(layer, i, centres_[i]);
      if (accept(i, centres_[i], {guesses_[i].u, guesses_[i].v})) continue;
      if (!wanted(i)) continue;
      if (velocity_[i].squared() > 1.0F && fitAt(layer, i, previous_[i])) continue;  // it may have stopped
      // What the torn frame had moved aside is back where the last whole one had it.
      if (wasTorn && wasValid_[i] && tears_.referenceValid()[i]) fitAt(layer, i, rest_[i] + tears_.reference_px()[i]);
    }
  }
  if (std::exchange(newAppearance_, false)) {
    errors_.learnShape(centres_, valid_);
    if (taking_ && takingRequested_) errors_.learnOwnShapes(centres_, valid_);
  }
  finishFrame(false);
}

void Tracker::finishFrame(bool thorough) {
  recover();
  markOverlaps();
  for (Layer& layer : layers_) {
    errors_.weigh(
        layer.lattice, layer.markers.front().used(), centres_, displacement_, restAmplitude_, slopeFrames_,
        [this, &layer](int marker, float mostMisfit) { return adoptDeformed(layer, marker, mostMisfit); }, valid_);
  }
  for (int i = 0; i < markers_; ++i) stepped_[i] = stepped_[i] && valid_[i];
  torn_ = tears_.torn(displacement_, errors_.variance_px2(), valid_) || torn_;
  for (int i = 0; i < markers_; ++i) thorough = thorough || valid_[i] != wasValid_[i];
  for (Layer& layer : layers_) layer.trust.prune(displacement_, valid_, thorough);
  learnSlopes();
  guessLost();
}

/// Where the marker's disc, as an ellipse of any size, leaves at most so much of the picture unexplained, its centre is
/// this one's.
bool Tracker::adoptDeformed(const Layer& layer, int marker, float mostMisfit) {
  Centre centre = centres_[marker];
  const MarkerTemplate& disc = layer.markers[size_[marker]];
  if (!fitDeformedCentre(layer.plane, disc, layer.crossTalk, guessAt(marker, place_[marker]), centre)) return false;
  if (centre.misfit > mostMisfit) return false;
  return accept(marker, centre, place_[marker]);
}

Guess Tracker::guessAt(int marker, Vector place) const {
  return {place.u,          place.v,         kCatch * restAmplitude_[marker], mixed_[marker] != 0, size_[marker],
          slope_[marker].u, slope_[marker].v};
}

/// A reflection beside the marker pulls its centre. The slope of the surroundings is known from the frames before;
/// where this window shows another, it counts alone, at the price of precision.
void Tracker::heedSlope(const Layer& layer, int marker, Centre& centre) {
  if (!centre.found) return;
  const Vector seen{centre.slopeU, centre.slopeV};
  const float frames = slopeFrames_[marker];
  const float limit2 = kSlopeDeviations * kSlopeDeviations * errors_.noise() * errors_.noise() * centre.slopeVariance;
  if (frames < 1.0F || (seen - slope_[marker]).squared() > limit2 * (1.0F + 1.0F / frames)) {
    slope_[marker] = seen;
    slopeFrames_[marker] = 0;
    const Guess guess = guessAt(marker, {centre.u, centre.v});
    fitCentres(layer.plane, layer.markers, layer.crossTalk, {&guess, 1}, {&centre, 1});
  }
  centre.slopeShare /= std::max<float>(slopeFrames_[marker], 1.0F);
}

void Tracker::learnSlopes() {
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

bool Tracker::accept(int marker, const Centre& centre, Vector expected) {
  if (!centre.found) return false;
  const float rest = restAmplitude_[marker], amplitude = centre.amplitude;
  if (!(amplitude >= kDim * rest && amplitude <= kBright * rest)) return false;
  if (!errors_.isMarker(marker, centre)) return false;
  const Vector place{centre.u, centre.v};
  if ((place - expected).squared() > kWander * kWander * spacing_px_ * spacing_px_) return false;
  centres_[marker] = centre;
  place_[marker] = place;
  displacement_[marker] = place - rest_[marker];
  increment_[marker] = place - previous_[marker];
  valid_[marker] = 1;
  stepped_[marker] = wasValid_[marker];
  return true;
}

bool Tracker::fitAt(const Layer& layer, int marker, Vector place) {
  const Guess guess = guessAt(marker, place);
  Centre centre;
  fitCentres(layer.plane, layer.markers, layer.crossTalk, {&guess, 1}, {&centre, 1});
  heedSlope(layer, marker, centre);
  return accept(marker, centre, place);
}

const MarkerTemplate& Tracker::roughOf(Layer& layer) {
  if (layer.roughScale != layer.plane.scale) {
    layer.rough = roughTemplate(layer.plane, layer.radius_px);
    layer.roughScale = layer.plane.scale;
  }
  return layer.rough;
}

/// As many columns and rows as described.
bool Tracker::latticesFit() const {
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    const LatticeSeen& seen = sight_.layers[i].seen;
    const Lattice& lattice = layers_[i].lattice;
    const auto isWhole = [&](const LatticeSeen& one) {
      return one.columns == lattice.columns && one.rows == lattice.rows;
    };
    if (seen.columns != 0 && !isWhole(seen) && !isWhole(extentWith(seen, lattice, valid_))) return false;
  }
  return true;
}

void Tracker::reportSight() {
  for (std::size_t i = 0; i < layers_.size(); ++i) {
    MarkerSight::Layer& sight = sight_.layers[i];
    const auto first = layers_[i].lattice.first, count = layers_[i].lattice.count();
    const auto ones = [&](const std::vector<std::uint8_t>& flags) {
      return static_cast<int>(std::count(flags.begin() + first, flags.begin() + first + count, 1));
    };
    sight.found = ones(valid_);
    sight.inZero = haveRest_ ? ones(present_) : 0;
  }
  sight_.following = following_;
  sights_.put(sight_);
}

void Tracker::prepare(Snapshot& snapshot) const {
  const auto count = static_cast<std::size_t>(markers_);
  snapshot.place_px.resize(2 * count);
  snapshot.state.resize(count);
  snapshot.spot_px.reserve(2 * 4 * count * layers_.size());
  snapshot.spotLayer.reserve(4 * count * layers_.size());
}

void Tracker::show(Snapshot& snapshot) const {
  for (int i = 0; i < markers_; ++i) {
    const Vector place = following_ ? place_[i] : haveRest_ ? rest_[i] : nominal_[i];
    snapshot.place_px[2 * i] = place.u;
    snapshot.place_px[2 * i + 1] = place.v;
    snapshot.state[i] = !following_   ? MarkerState::kSought
                        : valid_[i]   ? MarkerState::kFound
                        : present_[i] ? MarkerState::kLost
                                      : MarkerState::kAbsent;
  }
  snapshot.spot_px.clear();
  snapshot.spotLayer.clear();
  for (std::size_t layer = 0; layer < layers_.size(); ++layer) {
    for (const Spot& spot : layers_[layer].spots) {
      snapshot.spot_px.push_back(spot.u);
      snapshot.spot_px.push_back(spot.v);
      snapshot.spotLayer.push_back(static_cast<std::uint8_t>(layer));
    }
  }
}

void Tracker::write(const FrameInfo& info, bool relabelled, MarkerField& field) {
  assert(field.valid.size() == static_cast<std::size_t>(markers_));
  field.info = info;
  field.zero = zero_;
  field.validCount = 0;
  field.isolatedGaps = isolatedGaps_;
  double square = 0.0, expected = 0.0;
  for (int i = 0; i < markers_; ++i) {
    const bool valid = valid_[i] && present_[i] && haveRest_;
    field.valid[i] = valid ? 1 : 0;
    if (!valid) {
      field.displacement_px[2 * i] = field.displacement_px[2 * i + 1] = field.variance_px2[i] = 0.0F;
      continue;
    }
    field.displacement_px[2 * i] = displacement_[i].u;
    field.displacement_px[2 * i + 1] = displacement_[i].v;
    field.variance_px2[i] = errors_.variance_px2()[i];
    ++field.validCount;
    square += displacement_[i].squared();
    expected += 2.0 * field.variance_px2[i];
  }
  const bool few = field.validCount < options_.minValidFraction * markers_;
  agreeing_ = !few && square < kAgreement * kAgreement * expected ? agreeing_ + 1 : 0;
  if (zeroWasRequested_ && agreeing_ >= kAgreeingFrames) verified_ = true;
  field.flags = (verified_ ? 0U : kZeroUnverified) | (few ? kFewMarkers : 0U) |
                (info.discontinuity ? kDiscontinuity : 0U) | (relabelled ? kReacquiring : 0U) | (torn_ ? kTorn : 0U) |
                (info.doubted ? kDoubtedOrigin : 0U) |
                (latticesFit() && (verdict_.zero != zero_ || verdict_.fits) ? 0U : kGelMismatch);
}

}  // namespace tractiond::track
