// What the tracker follows by: what markers look like, and the zero from the request to its adoption.
#include "daemon/track/appearance.h"
#include "daemon/track/rest_pose.h"
#include "daemon/track/tracker.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <thread>
#include <utility>

namespace tractiond::track {

namespace {

constexpr std::size_t kAppearancePlaces = 300;

float median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void Tracker::restore(const RestPose& pose) {
  assert(pose.amplitude.size() == static_cast<std::size_t>(markers_));
  adopt(pose);
  for (Layer& layer : layers_) {
    layer.crossTalk = {pose.crossTalk[1 - layer.rank], pose.crossTalk[layer.rank]};
  }
  zeroWasRequested_ = pose.requested;
  verified_ = false;
}

/// The camera may be nearer or farther than described: the markers are then as much larger or smaller as the pattern.
void Tracker::learnSize(Layer& layer, std::span<const std::uint8_t> seen) {
  const Lattice& lattice = layer.lattice;
  float shown = 0.0F, described = 0.0F;
  const auto add = [&](int one, int other) {
    if (!seen[one] || !seen[other]) return;
    shown += std::sqrt((place_[other] - place_[one]).squared());
    described += std::sqrt((nominal_[other] - nominal_[one]).squared());
  };
  for (int row = 0; row + 1 < lattice.rows; ++row) {
    for (int column = 0; column + 1 < lattice.columns; ++column) {
      const int node = lattice.at(column, row);
      add(node, node + 1);
      add(node, node + lattice.columns);
    }
  }
  if (described > 0.0F) layer.radius_px = layer.described_px * static_cast<double>(shown / described);
}

/// From the markers that are `seen`, where they are.
void Tracker::learnAppearance(std::span<const std::uint8_t> seen) {
  for (Layer& layer : layers_) {
    learnSize(layer, seen);
    layer.markers = {roughTemplate(layer.plane, layer.radius_px)};
  }
  markOverlaps();
  const auto places = [&](const Layer& layer, bool unseen) {
    std::vector<Guess> all;
    for (int i = layer.lattice.first; i < layer.lattice.first + layer.lattice.count(); ++i) {
      if (unseen || seen[i]) all.push_back({place_[i].u, place_[i].v, layer.plane.unit, mixed_[i] != 0});
    }
    return all;
  };
  if ((!haveRest_ || (taking_ && takingRequested_)) && planes_.mixes()) {
    for (std::size_t i = 0; i < 2; ++i) {
      Layer &own = layers_[i], &other = layers_[1 - i];
      own.crossTalk.own = other.crossTalk.other =
          crossTalkInto(own.plane, own.otherPlane, own.markers.front(), places(own, false));
    }
  }
  for (Layer& layer : layers_) {
    // Dots that differ too much from the others to be found may be there all the same.
    const auto first = static_cast<std::size_t>(layer.lattice.first),
               count = static_cast<std::size_t>(layer.lattice.count());
    Sizes sizes = fittingSizes(layer.plane, layer.radius_px, layer.crossTalk, places(layer, true),
                               seen.subspan(first, count), kAppearancePlaces);
    layer.markers = std::move(sizes.markers);
    layer.radius_px = sizes.radius_px;
    std::ranges::copy(sizes.of, size_.begin() + layer.lattice.first);
  }
  haveAppearance_ = true;
}

/// For the zero that is asked for. Where the picture is not followed, the next acquisition learns.
void Tracker::relearnAppearance() {
  haveAppearanceBefore_ = haveAppearance_;
  appearanceBeforeOf_ = zero_;
  for (Layer& layer : layers_) {
    layer.markersBefore = layer.markers;
    layer.crossTalkBefore = layer.crossTalk;
  }
  sizeBefore_ = size_;
  haveAppearance_ = false;
  acquireIn_ = 0;
  if (!following_) return;
  learnAppearance(std::vector<std::uint8_t>(valid_));
  errors_.forgetShape();
  newAppearance_ = true;
}

/// A zero that was refused leaves nothing behind.
void Tracker::restoreAppearance() {
  if (!std::exchange(haveAppearanceBefore_, false)) return;
  for (Layer& layer : layers_) {
    std::swap(layer.markers, layer.markersBefore);  // no allocation
    std::swap(layer.crossTalk, layer.crossTalkBefore);
  }
  std::swap(size_, sizeBefore_);
  haveAppearance_ = true;
  errors_.restoreOwnShapes();
  errors_.forgetShape();
  newAppearance_ = true;
}

/// Puts the markers that no spot was found for where those around them say.
void Tracker::placeUnlabelled() {
  const std::vector<Vector>& reference = haveRest_ ? rest_ : nominal_;
  for (int i = 0; i < markers_; ++i) displacement_[i] = place_[i] - reference[i];
  for (const Layer& layer : layers_) {
    const Lattice& lattice = layer.lattice;
    for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
      if (labelled_[i]) continue;
      const int column = (i - lattice.first) % lattice.columns, row = (i - lattice.first) / lattice.columns;
      const auto whole = expectation(lattice, column, row, displacement_, labelled_);
      place_[i] = whole ? reference[i] + whole->value : reference[i];
    }
  }
}

/// Until there is a rest pose, the first labelled picture stands in for it.
void Tracker::assumeRest() {
  for (Layer& layer : layers_) {
    const Lattice& lattice = layer.lattice;
    std::vector<float> amplitudes;
    for (const Spot& spot : layer.spots) amplitudes.push_back(spot.amplitude);
    const float typical = median(amplitudes);
    for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
      rest_[i] = place_[i];
      restAmplitude_[i] = typical;
      if (labelled_[i])
        restAmplitude_[i] =
            std::max(amplitudeAt(layer.plane, layer.markers[size_[i]], place_[i].u, place_[i].v), 0.5F * typical);
    }
  }
  std::fill(present_.begin(), present_.end(), std::uint8_t{1});
}

bool Tracker::cancelZero() {
  ZeroState seen = zeroState_.load(std::memory_order_relaxed);
  while (seen == ZeroState::kRequested || seen == ZeroState::kTaking) {
    if (zeroState_.compare_exchange_weak(seen, ZeroState::kNone, std::memory_order_relaxed)) return true;
  }
  return false;
}

/// Begins the zero that was requested; ends the one whose request was cancelled. Called before the frame is tracked.
void Tracker::heedRequest() {
  if (taking_ && takingRequested_ && zeroState_.load(std::memory_order_relaxed) != ZeroState::kTaking) {
    taking_ = false;
    inputs_.zeroEnded = true;
    restoreAppearance();
  }
  ZeroState requested = ZeroState::kRequested;
  if (!zeroState_.compare_exchange_strong(requested, ZeroState::kTaking, std::memory_order_relaxed)) return;
  inputs_.zeroBegun = true;
  beginZero(true);
  relearnAppearance();
}

void Tracker::beginZero(bool requested) {
  taking_ = true;
  takingRequested_ = requested;
  tornWhileTaking_ = 0;
  taker_.start();
  pixelNoise_.start();
}

void Tracker::takeZero(const FrameInfo& info) {
  if (poseWaits_) poseWaits_ = !finished_.put(pose_);
  if (!haveRest_ && !taking_ && following_) {
    beginZero(false);
    ZeroState none = ZeroState::kNone;  // a refusal stays to be read until a zero is taken
    zeroState_.compare_exchange_strong(none, ZeroState::kTakingFirst, std::memory_order_relaxed);
  }
  if (!taking_) return;
  ZeroState state = ZeroState::kTaking;
  MarkerSight::FirstZero& first = sight_.firstZero;
  if (!haveRest_) ++first.frames;
  if (torn_) {
    if (++tornWhileTaking_ > options_.zeroFrames) state = ZeroState::kTorn;
  } else {
    for (Layer& layer : layers_) {
      pixelNoise_.add(layer.plane, layer.lattice.first, ofLayer(place_, layer), {0.5F * spacing_px_, 0.0F},
                      ofLayer(valid_, layer));
    }
    state = taker_.add(place_, centres_, valid_);
  }
  if (!haveRest_) first.mostStill = std::max(first.mostStill, taker_.stillFrames());
  if (state == ZeroState::kTaking) return;
  taking_ = false;
  if (std::exchange(forgo_, false)) cancelZero();
  const bool stillAsked = report(state);
  inputs_.zeroForgone = !stillAsked;
  if (state != ZeroState::kTaken || !stillAsked) {
    if (takingRequested_) restoreAppearance();
    return;
  }
  for (int i = 0; i < markers_; ++i) {
    pose_.position_px[2 * i] = rest_[i].u;
    pose_.position_px[2 * i + 1] = rest_[i].v;
    pose_.amplitude[i] = restAmplitude_[i];
  }
  pose_.shotNoise = pixelNoise_.perLevel();
  for (const Layer& layer : layers_) {
    taker_.finish(layer.lattice, pose_);
    pose_.crossTalk[static_cast<std::size_t>(layer.rank)] = layer.crossTalk.other;
  }
  pose_.noise = taker_.noise();
  pose_.light = taker_.light();
  pose_.taken_ns = info.times.receivedReal_ns;
  pose_.requested = takingRequested_;
  pose_.id = idOf(pose_);
  if (options_.awaitJudge && haveRest_) {
    proposed_ns_ = pose_.taken_ns;
  } else {
    before_ = {zero_, verified_};
    adopt(pose_);
    errors_.learnShape(centres_, valid_);
    verified_ = zeroWasRequested_ = takingRequested_;
  }
  poseWaits_ = !finished_.put(pose_);
}

/// Publishes the state in which a zero has ended. Returns false if the zero was requested and its request has been
/// cancelled meanwhile. A request that has come meanwhile stays.
bool Tracker::report(ZeroState state) {
  if (takingRequested_) {
    ZeroState taking = ZeroState::kTaking;
    return zeroState_.compare_exchange_strong(taking, state, std::memory_order_relaxed);
  }
  ZeroState seen = zeroState_.load(std::memory_order_relaxed);
  while (seen != ZeroState::kRequested && !zeroState_.compare_exchange_weak(seen, state, std::memory_order_relaxed)) {
  }
  return true;
}

void Tracker::heedDecision() {
  if (!decisions_.take(decision_)) return;
  const RestPose& pose = decision_.zero;
  inputs_.adopted = inputs_.judged = true;
  inputs_.zero = pose;
  inputs_.judgedZero = pose.id;
  inputs_.fits = decision_.fits;
  verdict_ = {pose.id, decision_.fits};
  const bool wasProposed = pose.taken_ns == proposed_ns_, inForce = pose.id == zero_;
  proposed_ns_.reset();
  if (haveAppearanceBefore_ && appearanceBeforeOf_ == pose.id) {
    restoreAppearance();
    if (!inForce) {  // the other one is kept for the zero that is replaced
      haveAppearanceBefore_ = true;
      appearanceBeforeOf_ = zero_;
    }
  }
  if (inForce) return;
  const Standing now{zero_, verified_};
  adopt(pose);
  if (wasProposed) errors_.learnShape(centres_, valid_);
  verified_ = wasProposed || (before_.zero == zero_ && before_.verified);
  zeroWasRequested_ = pose.requested;
  before_ = now;
}

void Tracker::heedVerdict() {
  if (!verdicts_.take(heard_) && !newVerdict_) return;
  newVerdict_ = false;
  if (heard_.zero != zero_) return;
  verdict_ = heard_;
  inputs_.judged = true;
  inputs_.judgedZero = verdict_.zero;
  inputs_.fits = verdict_.fits;
}

void Tracker::repeat(const TrackerInputs& inputs) {
  if (inputs.zeroEnded) cancelZero();
  if (inputs.zeroBegun) requestZero();
  forgo_ = inputs.zeroForgone;
  if (inputs.adopted) putInForce(inputs.zero, inputs.judged && inputs.fits);
  if (inputs.judged) judge(inputs.judgedZero, inputs.fits);
}

void Tracker::adopt(const RestPose& pose) {
  for (int i = 0; i < markers_; ++i) {
    rest_[i] = {pose.position_px[2 * i], pose.position_px[2 * i + 1]};
    displacement_[i] = place_[i] - rest_[i];
  }
  restAmplitude_ = pose.amplitude;
  present_ = pose.present;
  isolatedGaps_ = 0;
  for (const Layer& layer : layers_) isolatedGaps_ += isolatedGaps(layer.lattice, present_);
  errors_.adopt(pose);
  zero_ = pose.id;
  haveRest_ = true;
  agreeing_ = 0;
  tears_.forget();
}

bool Tracker::awaitsFirstVerdict() {
  if (verdicts_.take(heard_)) newVerdict_ = true;
  return options_.awaitJudge && haveRest_ && !newVerdict_ && verdict_.zero == Id{};
}

void Tracker::judge(const Id& zero, bool fits) {
  while (!verdicts_.put({zero, fits})) std::this_thread::yield();  // just being taken: some instructions
}

}  // namespace tractiond::track
