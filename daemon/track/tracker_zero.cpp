// Takes the zero, from the request until it is in force.
#include "daemon/track/rest_pose.h"
#include "daemon/track/tracker.h"

#include <algorithm>
#include <cassert>
#include <thread>
#include <utility>

namespace tractiond::track {

void Tracker::restore(const RestPose& pose) {
  assert(pose.amplitude.size() == static_cast<std::size_t>(markers_));
  follower_.setCrossTalk(pose);
  install(pose);
}

bool Tracker::cancelZero() {
  ZeroState seen = zeroState_.load(std::memory_order_relaxed);
  while (seen == ZeroState::kRequested || seen == ZeroState::kTaking) {
    if (zeroState_.compare_exchange_weak(seen, ZeroState::kNone, std::memory_order_relaxed)) return true;
  }
  return false;
}

/// Begins the zero that was requested; ends the one whose request was cancelled. Called before the frame is tracked.
void Tracker::noteRequest() {
  if (taking_ && takingRequested_ && zeroState_.load(std::memory_order_relaxed) != ZeroState::kTaking) {
    taking_ = false;
    inputs_.zeroEnded = true;
  }
  ZeroState requested = ZeroState::kRequested;
  if (!zeroState_.compare_exchange_strong(requested, ZeroState::kTaking, std::memory_order_relaxed)) return;
  inputs_.zeroBegun = true;
  candidate_ = follower_;
  candidate_.learnAnew();
  beginZero(true);
}

void Tracker::beginZero(bool requested) {
  taking_ = true;
  takingRequested_ = requested;
  discarded_ = 0;
  wasUnsteady_ = false;
  taker_.start();
  pixelNoise_.start();
}

/// Adds the frame to the zero that is being taken. The first one begins by itself.
void Tracker::takeZero(const FrameInfo& info) {
  if (poseWaits_) poseWaits_ = !finished_.put(pose_);
  const bool isFirst = !follower_.reference().isZero;
  if (isFirst && !taking_ && follower_.following()) {
    beginZero(false);
    ZeroState none = ZeroState::kNone;  // a refusal can be read until a zero is taken
    zeroState_.compare_exchange_strong(none, ZeroState::kTakingFirst, std::memory_order_relaxed);
  }
  if (!taking_) return;
  const Follower& follower = source();
  ZeroState state = ZeroState::kTaking;
  MarkerSight::FirstZero& first = sight_.firstZero;
  if (isFirst) ++first.frames;
  if (follower.torn()) {
    if (++discarded_ > options_.zeroFrames) state = wasUnsteady_ ? ZeroState::kUnsteady : ZeroState::kTorn;
  } else {
    for (const Follower::Layer& layer : follower.layers()) {
      pixelNoise_.add(layer.plane, layer.lattice.first, Follower::ofLayer(follower.place_px(), layer),
                      {0.5F * follower.spacing_px(), 0.0F}, Follower::ofLayer(follower.valid(), layer));
    }
    state = taker_.add(follower.place_px(), follower.centres(), follower.valid());
  }
  if (isFirst) first.mostStill = std::max(first.mostStill, taker_.stillFrames());
  if (state == ZeroState::kTaking) return;
  if (state == ZeroState::kUnsteady) {
    // The appearance was learned in other light, too.
    (takingRequested_ ? candidate_ : follower_).learnAnew();
    wasUnsteady_ = true;
    discarded_ += taker_.frames();
    if (isFirst) {
      first.brighter = static_cast<float>(taker_.brightness().share());
      first.moreContrast = static_cast<float>(taker_.contrast().share());
      first.changedOver = taker_.frames();
    }
    if (takingRequested_ && discarded_ <= options_.zeroFrames) {
      taker_.start();
      pixelNoise_.start();
      return;
    }
  }
  taking_ = false;
  if (std::exchange(forgo_, false)) cancelZero();
  const bool stillAsked = report(state);
  inputs_.zeroForgone = !stillAsked;
  if (state != ZeroState::kTaken || !stillAsked) return;
  finishPose(info);
  if (takingRequested_) {
    proposed_ns_ = pose_.taken_ns;
    candidate_.exchangeAppearance(proposed_);
  }
  if (!options_.awaitsGelCheck || isFirst) install(pose_);
  if (!takingRequested_) follower_.learnShape();
  poseWaits_ = !finished_.put(pose_);
}

/// Fills pose_ with the averages of the frames.
void Tracker::finishPose(const FrameInfo& info) {
  const Reference& reference = source().reference();
  for (int i = 0; i < markers_; ++i) {
    pose_.position_px[2 * i] = reference.place_px[i].u;
    pose_.position_px[2 * i + 1] = reference.place_px[i].v;
    pose_.amplitude[i] = reference.amplitude[i];
  }
  pose_.shotNoise = pixelNoise_.perLevel();
  for (const Follower::Layer& layer : source().layers()) {
    taker_.finish(layer.lattice, pose_);
    pose_.crossTalk[static_cast<std::size_t>(layer.rank)] = reference.appearance.layers[layer.index].crossTalk.other;
  }
  pose_.noise = taker_.noise();
  pose_.light = taker_.light();
  pose_.taken_ns = info.times.receivedReal_ns;
  pose_.requested = takingRequested_;
  pose_.id = idOf(pose_);
}

/// Publishes the state in which a zero has ended. Returns false if the zero was requested and its request has been
/// cancelled meanwhile. A request that has arrived meanwhile remains.
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

/// Measures from another zero from now on; the appearance of the markers changes with the proposed one alone.
void Tracker::install(const RestPose& pose) {
  const bool isProposed = proposed_ns_ == pose.taken_ns;
  const bool verified = isProposed || (before_ == pose.id && beforeWasVerified_);
  if (isProposed) follower_.exchangeAppearance(proposed_);
  proposed_ns_.reset();
  follower_.adopt(pose);
  before_ = std::exchange(zero_, pose.id);
  beforeWasVerified_ = std::exchange(verified_, verified);
  zeroWasRequested_ = pose.requested;
  agreeing_ = 0;
}

/// Carries out a call of putInForce().
void Tracker::noteDecision() {
  if (!decisions_.take(decision_)) return;
  const RestPose& pose = decision_.zero;
  inputs_.adopted = inputs_.compared = true;
  inputs_.zero = pose;
  inputs_.comparedZero = pose.id;
  inputs_.fits = decision_.fits;
  verdict_ = {pose.id, decision_.fits};
  if (pose.id == zero_) {
    proposed_ns_.reset();
  } else {
    install(pose);
  }
}

void Tracker::noteVerdict() {
  if (!verdicts_.take(heard_) && !newVerdict_) return;
  newVerdict_ = false;
  if (heard_.zero != zero_) return;
  verdict_ = heard_;
  inputs_.compared = true;
  inputs_.comparedZero = verdict_.zero;
  inputs_.fits = verdict_.fits;
}

void Tracker::repeat(const TrackerInputs& inputs) {
  if (inputs.zeroEnded) cancelZero();
  if (inputs.zeroBegun) requestZero();
  forgo_ = inputs.zeroForgone;
  if (inputs.adopted) putInForce(inputs.zero, inputs.compared && inputs.fits);
  if (inputs.compared) setGelFits(inputs.comparedZero, inputs.fits);
}

bool Tracker::awaitsFirstVerdict() {
  if (verdicts_.take(heard_)) newVerdict_ = true;
  return options_.awaitsGelCheck && follower_.reference().isZero && !newVerdict_ && verdict_.zero == Id{};
}

void Tracker::setGelFits(const Id& zero, bool fits) {
  while (!verdicts_.put({zero, fits})) std::this_thread::yield();  // the other thread is taking it: some instructions
}

}  // namespace tractiond::track
