#include "daemon/calibrate/creep_reading.h"

#include "daemon/track/creep_memory.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <span>

namespace tractiond::calibrate {
namespace {

constexpr double kUntouched_s = 1.0;    // for which the gel must be so before the load
constexpr int kFewestMarkers = 50;      // that are seen all the time
constexpr double kFast_s = 1.0;         // after a change, in which each frame is a sample
constexpr double kLonger = 0.05;        // length of later samples, as a part of the time since the change
constexpr double kStanding_s = 3.0;     // after a change, from which on nothing but the pattern may be seen
constexpr double kGone = 0.5;           // of the load: what displaces less is no longer it
constexpr std::size_t kChecked = 40;    // samples that are compared with the pattern: a comparison takes 0.3 ms
constexpr double kOtherPattern = 0.05;  // of the largest displacement: what a growing area of contact may do

tl::unexpected<std::string> refused(const std::string& sentence) {
  return tl::unexpected(sentence);
}

/// Returns the length of the largest displacement.
float largest(const Eigen::VectorXf& displacements) {
  return displacements.reshaped(2, displacements.size() / 2).colwise().norm().maxCoeff();
}

}  // namespace

CreepReading::CreepReading(const sensor::Sensor& sensor, double held_s)
    : sensor_(sensor)
    , held_s_(held_s)
    , motion_(sensor)
    , valid_(static_cast<std::size_t>(sensor.markerCount()), 1) {}

std::optional<CreepReading::Result> CreepReading::add(const MarkerField& field) {
  const std::int64_t now_ns = track::momentOf(field.info.times);
  if (!zero_) {
    zero_ = field.zero;
    begun_ns_ = now_ns_ = now_ns;
  }
  if (*zero_ != field.zero) return refused("a new zero was taken meanwhile");
  if (now_ns < now_ns_) return refused("the camera's clock was set back meanwhile");
  const auto motion = motion_({field.displacement_px, field.valid});
  if (!motion) return std::nullopt;
  now_ns_ = now_ns;
  const std::vector<float> remains_px = motion_.without(motion->value, field.displacement_px);
  for (std::size_t i = 0; i < valid_.size(); ++i) valid_[i] &= field.valid[i];

  const double now_s = 1e-9 * static_cast<double>(now_ns - begun_ns_);
  const auto state = watch(largestBulge(sensor_, {remains_px, field.valid}, kUntouched_px), now_s);
  keep(Eigen::Map<const Eigen::VectorXf>(remains_px.data(), std::ssize(remains_px)), now_s);
  if (!state) return std::nullopt;
  return *state ? find() : refused(state->error());
}

/// Follows the load. Returns an error, or success where there is something to find.
std::optional<tl::expected<void, std::string>> CreepReading::watch(const Bulge& load, double now_s) {
  using Done = tl::expected<void, std::string>;
  const double elapsed_s = now_s - since_s_;
  const auto turnTo = [&](LoadPhase phase) {
    phase_ = phase;
    since_s_ = now_s;
  };
  switch (phase_) {
  case LoadPhase::kUntouched:
    if (load.found() && elapsed_s < kUntouched_s)
      return refused("something touches the gel already, or the zero no longer holds: take everything off, and zero");
    if (load.found())
      turnTo(LoadPhase::kLoaded);
    else if (elapsed_s > kPatience_s)
      return refused("no load was put on the gel");
    return std::nullopt;
  case LoadPhase::kLoaded:
    if (elapsed_s <= kFast_s) {
      loadedSize_px_ = load.size_px;
    } else if (!load.found() || load.size_px < kGone * loadedSize_px_) {
      if (hasHeld_)
        turnTo(LoadPhase::kReleased);
      else
        return refused(fmt::format("the load left after {:.0f} s; it must stay for {:.0f} s", elapsed_s, held_s_));
    } else if (!hasHeld_ && elapsed_s >= held_s_) {
      hasHeld_ = true;
      return Done();
    } else if (elapsed_s > held_s_ + kPatience_s) {
      return refused("the load was not taken away");
    }
    return std::nullopt;
  case LoadPhase::kReleased:
    if (elapsed_s >= held_s_) return Done();
    return std::nullopt;
  }
  return std::nullopt;
}

/// Adds the displacements of a frame to the last sample, or begins another.
void CreepReading::keep(Eigen::VectorXf displacement, double now_s) {
  const double elapsed_s = now_s - since_s_;
  const double longest_s = phase_ == LoadPhase::kUntouched ? kPatience_s
                           : elapsed_s <= kFast_s          ? 0.0
                                                           : kLonger * elapsed_s;
  if (samples_.empty() || samples_.back().phase != phase_ || now_s - samples_.back().from_s > longest_s) {
    samples_.push_back({.from_s = now_s, .to_s = now_s, .sum = std::move(displacement), .frames = 1, .phase = phase_});
    return;
  }
  samples_.back().to_s = now_s;
  samples_.back().sum += displacement;
  ++samples_.back().frames;
}

CreepReading::Result CreepReading::find() const {
  const auto markers = std::ranges::count(valid_, 1);
  if (markers < kFewestMarkers) return refused(fmt::format("only {} markers were seen all the time", markers));
  const Eigen::VectorXf pattern = patternOf();
  std::vector<LoadReading> readings;
  double end_s = samples_.front().to_s;
  for (const Sample& sample : samples_) {
    readings.push_back({.at_s = 0.5 * (sample.from_s + sample.to_s),
                        .length_s = sample.to_s - end_s,
                        .amount = double{pattern.dot(displaced(sample))} / double{pattern.squaredNorm()},
                        .phase = sample.phase});
    end_s = sample.to_s;
  }
  const auto fit = fitCreep(readings, held_s_);
  if (!fit) {
    return refused("the load did not come to rest within three seconds, or moved later: put it on and take it away "
                   "quickly, and let it stand still");
  }
  if (!isOfPattern(pattern)) return refused("the load moved sideways, or something else touched the gel");
  return Creep{.fit = *fit, .pattern_px = pattern.cast<double>(), .time_ns = now_ns_, .zero = *zero_};
}

/// Returns the mean of what the load displaces once it stands.
Eigen::VectorXf CreepReading::patternOf() const {
  const auto loaded = std::ranges::find(samples_, LoadPhase::kLoaded, &Sample::phase);
  Eigen::VectorXf pattern = Eigen::VectorXf::Zero(loaded->sum.size());
  int samples = 0;
  for (auto each = loaded; each != samples_.end() && each->phase == LoadPhase::kLoaded; ++each) {
    if (each->from_s <= loaded->from_s + kFast_s) continue;
    pattern += displaced(*each);
    ++samples;
  }
  return pattern / static_cast<float>(std::max(samples, 1));
}

/// Returns by how much a sample differs from the untouched gel, for markers that were seen all the time.
Eigen::VectorXf CreepReading::displaced(const Sample& sample) const {
  const Sample& untouched = samples_.front();
  Eigen::VectorXf change =
      sample.sum / static_cast<float>(sample.frames) - untouched.sum / static_cast<float>(untouched.frames);
  for (std::size_t i = 0; i < valid_.size(); ++i) {
    if (valid_[i] == 0) change.segment<2>(2 * static_cast<Eigen::Index>(i)).setZero();
  }
  return change;
}

/// Returns whether some dozens of samples show the pattern and nothing else, but for the ways of the load.
bool CreepReading::isOfPattern(const Eigen::VectorXf& pattern) const {
  const double allowance_px = std::max(kUntouched_px, kOtherPattern * double{largest(pattern)});
  double phase_s = 0.0;
  for (std::size_t i = 1; i < samples_.size(); ++i) {
    if (samples_[i].phase != samples_[i - 1].phase) phase_s = samples_[i].from_s;
    if (samples_[i].from_s < phase_s + kStanding_s || i % (1 + samples_.size() / kChecked) != 0) continue;
    const Eigen::VectorXf seen = displaced(samples_[i]);
    const Eigen::VectorXf rest = seen - pattern * (pattern.dot(seen) / pattern.squaredNorm());
    const std::span values(rest.data(), static_cast<std::size_t>(rest.size()));
    if (largestBulge(sensor_, {values, valid_}, allowance_px).found()) return false;
  }
  return true;
}

}  // namespace tractiond::calibrate
