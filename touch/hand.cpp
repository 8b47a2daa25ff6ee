#include "touch/hand.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace touch {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Half width of a time of capture from which on it says nothing [ns].
constexpr std::int64_t kLongestError_ns = 1'000'000'000;

bool isDated(const FingerFrame& frame) {
  constexpr std::int64_t kLatest_ns = std::numeric_limits<std::int64_t>::max() / 2;
  return frame.header.capturedBound != CaptureBound::kNone && frame.header.captured_ns > 0 &&
         frame.header.captured_ns < kLatest_ns && frame.header.capturedError_ns >= 0 &&
         frame.header.capturedError_ns <= kLongestError_ns;
}

double difference_ns(std::int64_t a_ns, std::int64_t b_ns) {
  return std::abs(static_cast<double>(a_ns) - static_cast<double>(b_ns));
}

/// Returns the matrix that takes force and moment about the gel's origin to the hand's frame and origin.
Wrench::Matrix6 adjoint(const Pose& pose) {
  const Eigen::Vector3d& p = pose.position_m;
  Eigen::Matrix3d cross;
  cross << 0.0, -p.z(), p.y(), p.z(), 0.0, -p.x(), -p.y(), p.x(), 0.0;
  Wrench::Matrix6 matrix;
  matrix << pose.rotation, Eigen::Matrix3d::Zero(), cross * pose.rotation, pose.rotation;
  return matrix;
}

void transform(const Wrench::Matrix6& by, Wrench& wrench) {
  wrench.value = by * wrench.value;
  wrench.noise = by * wrench.noise * by.transpose();
  wrench.systematic = by * wrench.systematic * by.transpose();
}

}  // namespace

Hand::Hand(const std::vector<Pose>& poses) {
  for (const Pose& pose : poses) {
    tracks_.emplace_back().toHand = adjoint(pose);
  }
  grasp_.fingers.resize(poses.size());
}

const Grasp* Hand::take(std::size_t finger, const FingerFrame& frame, std::int64_t now_ns) {
  Track& track = tracks_[finger];
  const bool ambiguous = isAmbiguous(finger, frame, now_ns);
  if (track.isHeard) follow(track, frame);
  track.last = frame;
  track.heard_ns = now_ns;
  track.isHeard = true;
  if (ambiguous || !isDated(frame)) return nullptr;
  if (track.waiting.size() == kWaiting) track.waiting.erase(track.waiting.begin());
  track.waiting.push_back(frame);
  const std::vector<std::size_t> set = findSet();
  if (set.empty()) return nullptr;
  join(set);
  return &grasp_;
}

/// A daemon's boot does not come back after another one: where it does, two daemons have the finger's name.
bool Hand::isAmbiguous(std::size_t finger, const FingerFrame& frame, std::int64_t now_ns) {
  Track& track = tracks_[finger];
  const auto mark = [&](Track& one) {
    one.ambiguousUntil_ns = now_ns + kAmbiguity_ns;
    one.waiting.clear();
  };
  if (track.isHeard && frame.header.boot != track.last.header.boot) {
    if (frame.header.boot == track.bootBefore) mark(track);
    track.bootBefore = track.last.header.boot;
  }
  for (Track& other : tracks_) {
    if (&other == &track || !other.isHeard || now_ns - other.heard_ns > kAmbiguity_ns) continue;
    if (other.last.header.boot != frame.header.boot && other.last.header.sensor != frame.header.sensor) continue;
    mark(track);
    mark(other);
  }
  return now_ns < track.ambiguousUntil_ns;
}

void Hand::follow(Track& track, const FingerFrame& frame) {
  const FingerFrame& before = track.last;
  const double interval_ns = difference_ns(frame.header.captured_ns, before.header.captured_ns);
  if (frame.header.boot != before.header.boot || frame.header.frameNumber <= before.header.frameNumber ||
      frame.header.captured_ns < before.header.captured_ns) {
    track.waiting.clear();
    track.intervals_ns.clear();
  } else if (isDated(frame) && isDated(before)) {
    track.intervals_ns.add(interval_ns / static_cast<double>(frame.header.frameNumber - before.header.frameNumber));
  }
}

std::int64_t Hand::silence_ns() const {
  double longest_ns = 0.0;
  for (const Track& track : tracks_) longest_ns = std::max(longest_ns, track.intervals_ns.median(0.0));
  return static_cast<std::int64_t>(std::clamp(kPatientIntervals * longest_ns, kLeastSilence_ns, kMostSilence_ns));
}

std::vector<std::size_t> Hand::findSet() const {
  double shortest_ns = kInfinity;
  for (const Track& track : tracks_) shortest_ns = std::min(shortest_ns, track.intervals_ns.median(kInfinity));
  if (shortest_ns == kInfinity) return {};
  std::vector<std::size_t> best, set(tracks_.size());
  double least_ns = kInfinity;
  const std::vector<FingerFrame>& first = tracks_.front().waiting;
  for (set[0] = 0; set[0] < first.size(); ++set[0]) {
    const FingerFrame& frame = first[set[0]];
    double worst_ns = 0.0;
    for (std::size_t finger = 1; finger < tracks_.size(); ++finger) {
      double nearest_ns = kInfinity;
      const std::vector<FingerFrame>& waiting = tracks_[finger].waiting;
      for (std::size_t i = 0; i < waiting.size(); ++i) {
        const double apart_ns = difference_ns(waiting[i].header.captured_ns, frame.header.captured_ns);
        const auto errors_ns = static_cast<double>(waiting[i].header.capturedError_ns + frame.header.capturedError_ns);
        if (apart_ns - errors_ns > 0.5 * shortest_ns || apart_ns >= nearest_ns) continue;
        nearest_ns = apart_ns;
        set[finger] = i;
      }
      worst_ns = std::max(worst_ns, nearest_ns);
    }
    if (worst_ns >= least_ns) continue;
    least_ns = worst_ns;
    best = set;
  }
  return best;
}

void Hand::join(const std::vector<std::size_t>& set) {
  grasp_.valid = true;
  grasp_.wrench = {};
  grasp_.earliest_ns = std::numeric_limits<std::int64_t>::max();
  grasp_.latest_ns = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    Grasp::Finger& finger = grasp_.fingers[i];
    const auto used = track.waiting.begin() + static_cast<std::ptrdiff_t>(set[i]);
    finger.frame = *used;
    track.waiting.erase(track.waiting.begin(), used + 1);
    finger.state = finger.frame.valid ? FingerState::kMatched : FingerState::kNotValid;
    if (finger.frame.valid) {
      transform(track.toHand, finger.frame.wrench);
    } else {
      finger.frame.wrench = {};
      grasp_.valid = false;
    }
    grasp_.earliest_ns =
        std::min(grasp_.earliest_ns, finger.frame.header.captured_ns - finger.frame.header.capturedError_ns);
    grasp_.latest_ns =
        std::max(grasp_.latest_ns, finger.frame.header.captured_ns + finger.frame.header.capturedError_ns);
  }
  if (!grasp_.valid) return;
  for (const Grasp::Finger& finger : grasp_.fingers) {
    const auto sharing = std::ranges::count_if(grasp_.fingers, [&](const Grasp::Finger& other) {
      return other.frame.header.calibration == finger.frame.header.calibration;
    });
    grasp_.wrench.value += finger.frame.wrench.value;
    grasp_.wrench.noise += finger.frame.wrench.noise;
    grasp_.wrench.systematic += static_cast<double>(sharing) * finger.frame.wrench.systematic;
  }
}

const Grasp& Hand::wait(std::int64_t now_ns) {
  grasp_.valid = false;
  grasp_.wrench = {};
  grasp_.earliest_ns = grasp_.latest_ns = 0;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const Track& track = tracks_[i];
    Grasp::Finger& finger = grasp_.fingers[i];
    finger.frame = track.last;
    finger.frame.wrench = {};
    finger.state = !track.isHeard || now_ns - track.heard_ns > silence_ns() ? FingerState::kMissing
                   : now_ns < track.ambiguousUntil_ns                       ? FingerState::kAmbiguous
                   : !isDated(track.last)                                   ? FingerState::kUndated
                                                                            : FingerState::kUnmatched;
  }
  return grasp_;
}

}  // namespace touch
