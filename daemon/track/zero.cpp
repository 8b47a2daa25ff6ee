// Measures the pixel noise by its effect: the scatter of the centres, divided by that which the template predicts for
// unit noise. It therefore includes shot noise, rounding and the camera's filters, and the published variances are
// true. The motion of the whole picture (vibration) is subtracted first, as it is no noise of a marker; it is averaged.
#include "daemon/track/zero.h"

#include "base/quantile.h"

#include <algorithm>
#include <cmath>

namespace tractiond::track {

namespace {

constexpr int kFewest = 10;               // frames that are needed to distinguish motion from noise
constexpr double kPresent = 0.8;          // share of the frames in which a marker must have been seen
constexpr float kStill = 3.0F;            // deviations of the noise: a spread above is motion ...
constexpr float kStill_px = 0.03F;        // ... if it is also above this
constexpr double kMovers = 0.01;          // share of the markers that may have moved (dust, a bubble)
constexpr float kShake_px = 0.05F;        // rms of the whole picture's motion
constexpr float kNoiseOverMisfit = 1.5F;  // the scatter of the centres cannot be noise if the pixels do not show it
// Share of the mean by which brightness or contrast may change over the frames. After a lamp that came up over 25
// pictures from 30 % of its light (a change by 110 %), 68 of 204 untouched fields listed a contact, and 129 were torn;
// from 50 % 3 of 90 and 0; from 70 % (35 %) none: Light in tests/system/forces_test.py without this.
constexpr double kSteady = 0.1;
constexpr double kTrend = 5.0;      // standard deviations of the slope, beyond which a change is no flicker
constexpr float kRounding = 0.3F;   // levels: noise of rounding to 8 bits
constexpr float kDim = 0.5F;        // share of the neighbours' amplitude: below it there is dust on the marker ...
constexpr float kBright = 1.6F;     // ... above this the spot is dust
constexpr float kContrasts = 4.0F;  // deviations of the markers' contrasts; smaller differences are not dust

}  // namespace

const char* describe(ZeroState state) {
  switch (state) {
  case ZeroState::kMoving:
    return "zero refused: markers moved while it was taken; keep the gel untouched and the camera still";
  case ZeroState::kTooFew:
    return "zero refused: too few markers were seen";
  case ZeroState::kTorn:
    return "zero refused: most pictures are torn, their rows of different moments; is the camera or its link "
           "overloaded?";
  case ZeroState::kUnsteady:
    return "zero refused: brightness or contrast of the markers still changed while it was taken; wait until lamp, "
           "exposure and gain are steady, and take an exposure of whole periods of the mains' light (10 ms at 50 Hz)";
  default:
    return "";
  }
}

void Trend::add(double value) {
  sum_ += value;
  square_ += value * value;
  product_ += count_++ * value;
}

double Trend::share() const {
  const double n = count_, mean = sum_ / n, times = n * (n * n - 1.0) / 12.0;
  const double slope = (product_ - 0.5 * (n - 1.0) * sum_) / times;
  const double scatter2 = std::max(square_ - n * mean * mean - slope * slope * times, 0.0) / std::max(n - 2.0, 1.0);
  return slope * slope * times > kTrend * kTrend * scatter2 ? slope * n / mean : 0.0;
}

float ZeroTaker::Sums::spread2() const {
  const auto n = static_cast<float>(count);
  return 0.5F * (square - sum.squared() / n) / (n - 1.0F);
}

ZeroTaker::ZeroTaker(int markers, int frames, double minValidFraction)
    : frames_(std::max(frames, 2))
    , minValidFraction_(minValidFraction)
    , sums_(static_cast<std::size_t>(markers))
    , place_(sums_.size())
    , field_(sums_.size()) {
  ratios_.reserve(sums_.size());
}

void ZeroTaker::start() {
  std::fill(sums_.begin(), sums_.end(), Sums{});
  seen_ = 0;
  hasMoved_ = false;
  brightness_ = contrast_ = {};
  common_ = {};
  commonSquare_ = 0.0F;
  misfit_ = 0.0;
}

ZeroState ZeroTaker::add(std::span<const Vector> place_px, std::span<const Centre> centres,
                         std::span<const std::uint8_t> valid) {
  Vector common;
  double misfit = 0.0, level = 0.0, amplitude = 0.0;
  int known = 0, seen = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    if (!valid[i]) continue;
    ++seen;
    misfit += centres[i].misfit;
    level += centres[i].level;
    amplitude += centres[i].amplitude;
    if (sums_[i].count == 0) continue;
    common = common + (place_px[i] - sums_[i].origin);
    ++known;
  }
  if (seen < minValidFraction_ * static_cast<double>(sums_.size())) return ZeroState::kTooFew;
  if (known > 0) common = (1.0F / static_cast<float>(known)) * common;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    if (!valid[i]) continue;
    Sums& sums = sums_[i];
    if (sums.count == 0) sums.origin = place_px[i] - common;
    const Vector moved = place_px[i] - sums.origin - common;
    sums.sum = sums.sum + moved;
    sums.square += moved.squared();
    sums.amplitude += centres[i].amplitude;
    // Half of the variance by the slope's uncertainty is the same in all frames, and causes no spread.
    sums.variance += centres[i].variance + 0.5F * centres[i].slopeShare;
    sums.level += centres[i].level;
    sums.misfit += centres[i].misfit;
    ++sums.count;
  }
  common_ = common_ + common;
  commonSquare_ += common.squared();
  misfit_ += misfit / seen;
  brightness_.add(level / seen);
  contrast_.add(amplitude / seen);
  if (++seen_ < std::min(kFewest, frames_)) return ZeroState::kTaking;
  hasMoved_ = moved();
  if (hasMoved_) return ZeroState::kMoving;
  if (std::max(std::abs(brightness_.share()), std::abs(contrast_.share())) > kSteady) return ZeroState::kUnsteady;
  return seen_ < frames_ ? ZeroState::kTaking : ZeroState::kTaken;
}

bool ZeroTaker::moved() {
  const auto frames = static_cast<float>(seen_);
  if (commonSquare_ / frames - common_.squared() / (frames * frames) > kShake_px * kShake_px) return true;

  // The noise is the median ratio of the spread to that of unit noise: some markers may have moved.
  ratios_.clear();
  for (const Sums& sums : sums_) {
    if (sums.count >= kPresent * seen_) {
      ratios_.push_back(sums.spread2() / (sums.variance / static_cast<float>(sums.count)));
    }
  }
  if (ratios_.empty()) return true;
  const float median = quantile(ratios_);
  const auto ceiling = static_cast<float>(misfit_ / seen_) + kRounding * kRounding;
  if (median > kNoiseOverMisfit * kNoiseOverMisfit * ceiling) return true;

  int movers = 0;
  double sum = 0.0;
  for (const Sums& sums : sums_) {
    if (sums.count < kPresent * seen_) continue;
    const float spread2 = sums.spread2(), perNoise = sums.variance / static_cast<float>(sums.count);
    const float limit = kStill * std::sqrt(median * perNoise);
    if (spread2 > limit * limit + kStill_px * kStill_px) {
      ++movers;
    } else {
      sum += spread2 / perNoise;
    }
  }
  if (movers > kMovers * static_cast<double>(ratios_.size())) return true;
  noise_ = static_cast<float>(std::sqrt(sum / (static_cast<double>(ratios_.size()) - movers)));
  return false;
}

void ZeroTaker::finish(const Lattice& lattice, RestPose& pose) {
  const Vector common = (1.0F / static_cast<float>(frames_)) * common_;
  const float meanLight = light();
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
    const Sums& sums = sums_[i];
    pose.oddity[i] = 0.0F;
    pose.present[i] = sums.count >= kPresent * frames_ ? 1 : 0;
    if (!pose.present[i]) continue;
    const float inverse = 1.0F / static_cast<float>(sums.count);
    place_[i] = sums.origin + inverse * sums.sum + common;
    pose.amplitude[i] = inverse * sums.amplitude;
    const float noise2 = noise() * noise() + pose.shotNoise * (inverse * sums.level - meanLight);
    pose.oddity[i] = std::sqrt(std::max(inverse * sums.misfit - noise2, 0.0F)) / pose.amplitude[i];
  }
  const auto around = [&](int i) { return expectation(lattice, i, field_, pose.present); };
  // Dust dims a marker, or is itself taken for a bright one. The differences without dust are those of most markers.
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) field_[i] = {pose.amplitude[i], 0.0F};
  const auto brighter = [&](int i) {
    const auto usual = around(i);
    return usual ? std::log(pose.amplitude[i] / usual->u) : 0.0F;
  };
  ratios_.clear();
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
    if (pose.present[i]) ratios_.push_back(std::abs(brighter(i)));
  }
  // The median of |x| is 0.6745 deviations.
  const float usual = ratios_.empty() ? 0.0F : kContrasts / 0.6745F * quantile(ratios_);
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
    if (!pose.present[i]) continue;
    const float share = brighter(i);
    if (share < std::min(std::log(kDim), -usual) || share > std::max(std::log(kBright), usual)) pose.present[i] = 0;
  }
  const auto before = [&](int i) { return Vector{pose.position_px[2 * i], pose.position_px[2 * i + 1]}; };
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) field_[i] = place_[i] - before(i);
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
    if (!pose.present[i]) {
      const auto moved = around(i);
      place_[i] = before(i) + (moved ? *moved : Vector{});
    }
  }
  for (int i = lattice.first; i < lattice.first + lattice.count(); ++i) {
    pose.position_px[2 * i] = place_[i].u;
    pose.position_px[2 * i + 1] = place_[i].v;
  }
}

float ZeroTaker::light() const {
  double light = 0.0;
  int seen = 0;
  for (const Sums& sums : sums_) {
    if (sums.count < kPresent * frames_) continue;
    light += double{sums.level / static_cast<float>(sums.count)};
    ++seen;
  }
  return static_cast<float>(light / std::max(seen, 1));
}

float ZeroTaker::noise() const {
  return std::max(noise_, kRounding);
}

}  // namespace tractiond::track
