#include "daemon/track/tracker.h"

#include "daemon/track/nominal.h"

#include <algorithm>
#include <cassert>

namespace tractiond::track {

namespace {

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
    , workspace_(sensor)
    , follower_(sensor, options.zeroFrames, workspace_)
    , candidate_(sensor, options.zeroFrames, workspace_)
    , taker_(markers_, options.zeroFrames, options.minValidFraction)
    , pixelNoise_(markers_)
    , pose_(emptyPose(markers_))
    , finished_(emptyPose(markers_))
    , decisions_({emptyPose(markers_)})
    , decision_({emptyPose(markers_)}) {
  inputs_.zero = pose_;
  const auto layers = follower_.layers();
  for (std::size_t i = 0; i < layers.size(); ++i) sight_.layers[i].expected = layers[i].lattice.count();
  sight_.layerCount = static_cast<int>(layers.size());
}

Outcome Tracker::track(const Frame& frame, MarkerField& field) {
  inputs_.clear();
  workspace_.planes.read(frame);
  noteDecision();
  noteRequest();
  const bool relabelled = follower_.findMarkers(frame.info.discontinuity);
  if (taking_ && takingRequested_) candidate_.findMarkers(frame.info.discontinuity);
  reportSight();
  noteVerdict();
  write(frame.info, relabelled, field);
  const bool tracked = follower_.reference().isZero && (!options_.awaitsGelCheck || verdict_.zero == zero_);
  takeZero(frame.info);
  return tracked ? Outcome::kTracked : Outcome::kNoRestPose;
}

void Tracker::reportSight() {
  const auto layers = follower_.layers();
  const Reference& reference = follower_.reference();
  const auto ones = [](std::span<const std::uint8_t> flags, const Follower::Layer& layer) {
    const auto own = Follower::ofLayer(flags, layer);
    return static_cast<int>(std::count(own.begin(), own.end(), 1));
  };
  for (std::size_t i = 0; i < layers.size(); ++i) {
    MarkerSight::Layer& sight = sight_.layers[i];
    sight.found = ones(follower_.valid(), layers[i]);
    sight.inZero = reference.isZero ? ones(reference.present, layers[i]) : 0;
    sight.seen = layers[i].seen;
  }
  sight_.following = follower_.following();
  sights_.put(sight_);
}

void Tracker::prepare(Snapshot& snapshot) const {
  const auto count = static_cast<std::size_t>(markers_);
  snapshot.place_px.resize(2 * count);
  snapshot.state.resize(count);
  snapshot.spot_px.reserve(2 * 4 * count * follower_.layers().size());
  snapshot.spotLayer.reserve(4 * count * follower_.layers().size());
}

void Tracker::fill(Snapshot& snapshot) const {
  const Reference& reference = follower_.reference();
  const bool following = follower_.following();
  for (int i = 0; i < markers_; ++i) {
    const Vector place = following          ? follower_.place_px()[i]
                         : reference.isZero ? reference.place_px[i]
                                            : follower_.nominal_px()[i];
    snapshot.place_px[2 * i] = place.u;
    snapshot.place_px[2 * i + 1] = place.v;
    snapshot.state[i] = !following             ? MarkerState::kSought
                        : follower_.valid()[i] ? MarkerState::kFound
                        : reference.present[i] ? MarkerState::kLost
                                               : MarkerState::kAbsent;
  }
  snapshot.spot_px.clear();
  snapshot.spotLayer.clear();
  for (const Follower::Layer& layer : follower_.layers()) {
    for (const Spot& spot : layer.spots) {
      snapshot.spot_px.push_back(spot.u);
      snapshot.spot_px.push_back(spot.v);
      snapshot.spotLayer.push_back(static_cast<std::uint8_t>(layer.index));
    }
  }
}

void Tracker::write(const FrameInfo& info, bool relabelled, MarkerField& field) {
  assert(field.valid.size() == static_cast<std::size_t>(markers_));
  const Reference& reference = follower_.reference();
  field.info = info;
  field.zero = zero_;
  field.validCount = 0;
  field.isolatedGaps = reference.isolatedGaps;
  double square = 0.0, expected = 0.0;
  for (int i = 0; i < markers_; ++i) {
    const bool valid = follower_.valid()[i] && reference.present[i] && reference.isZero;
    field.valid[i] = valid ? 1 : 0;
    if (!valid) {
      field.displacement_px[2 * i] = field.displacement_px[2 * i + 1] = field.variance_px2[i] = 0.0F;
      continue;
    }
    field.displacement_px[2 * i] = follower_.displacement_px()[i].u;
    field.displacement_px[2 * i + 1] = follower_.displacement_px()[i].v;
    field.variance_px2[i] = follower_.variance_px2()[i];
    ++field.validCount;
    square += follower_.displacement_px()[i].squared();
    expected += 2.0 * field.variance_px2[i];
  }
  const bool few = field.validCount < options_.minValidFraction * markers_;
  agreeing_ = !few && square < kAgreement * kAgreement * expected ? agreeing_ + 1 : 0;
  if (zeroWasRequested_ && agreeing_ >= kAgreeingFrames) verified_ = true;
  field.flags = (verified_ ? 0U : kZeroUnverified) | (markers_ < sensor::kVerifying ? kGelUnverified : 0U) |
                (few ? kFewMarkers : 0U) | (relabelled ? kReacquiring : 0U) | (follower_.torn() ? kTorn : 0U) |
                (info.doubted ? kDoubtedOrigin : 0U) |
                (follower_.latticesFit() && (verdict_.zero != zero_ || verdict_.fits) ? 0U : kGelMismatch);
}

}  // namespace tractiond::track
