#include "touch/partial_slip.h"

#include <algorithm>
#include <cmath>

namespace touch {
namespace {

/// The least coefficient of friction that is considered.
constexpr double kLeastFriction = 0.03;

/// Deviations from which on a force is sure.
constexpr double kSure = 3.0;

/// Shares of the deviation of R: what is new in a frame, with what the model of an earlier one adds to its answer, and
/// what stays. With these, intervals of single frames and of many cover (tools/evaluate --only slip).
constexpr double kNew = 1.1, kStays = 0.25;

/// How far R of a ball on a real gel lies from Mindlin's, as a deviation that stays: of itself, and as a share of R
/// - 1. Contacts with friction by finite elements differ by 0.02 at 60 % of slipping and beyond, by 0.06 at 30 %.
constexpr double kModel = 0.01, kModelShare = 0.08;

/// Time in which the weight of a frame decays to 1 / e [s]. What stays is not the same after the shear has grown.
constexpr double kMemory_s = 0.05;

/// Shear that has not fallen may have grown beyond what is known, after so long without a frame that says of it [s].
constexpr double kStale_s = 0.2;

/// The shear has not fallen while Q / P is at least this share of the largest one of a contact that bore at least so
/// much of the present normal force.
constexpr double kLoaded = 0.95, kAsStrong = 0.5;

/// How far Q / P may exceed the friction besides its noise, as a deviation and a share: the two are not seen alike.
constexpr double kBound = 0.005;

/// Normal force that is held for each that is needed.
constexpr double kReserve = 1.25;

/// Width of the interval of a stick ratio from which on nothing is known of it.
constexpr double kVague = 0.8;

/// Frames that must show the same of a motion or an alarm: one frame may be off, as where it was solved in another way.
constexpr int kFrames = 2;

/// A contact has moved if it has by more than this [m] and by kSure deviations; it may bear no more shear if that is so
/// probable.
constexpr double kLeastMotion_m = 2e-4, kPossible = 0.05;

/// Share of the shear at which a contact slips from which on it is about to; the probability of that from which on it
/// is, and below which it no longer is. Measured: docs/decisions/0047-slip-of-many-frames.md.
constexpr double kIncipient = 0.8, kAlarm = 0.8, kCalm = 0.1;

double squared(double x) {
  return x * x;
}

double stickRatio(double share) {
  return std::cbrt(std::fmax(0.0, 1.0 - share));
}

/// Returns the friction of a fraction of the steps.
double frictionAt(double fraction) {
  return kLeastFriction * std::pow(kLargestFriction / kLeastFriction, fraction);
}

}  // namespace

double spreadRatio(double stickRatio) {
  // Without the division by 1 - c / a, of both.
  const double s = stickRatio, s2 = s * s;
  return (1.0 + s + s2 + s2 * s + s2 * s2) / (1.0 + s + s2);
}

/// Returns the middle of each step.
const std::array<double, PartialSlip::kSteps>& PartialSlip::frictions() {
  static const auto all = [] {
    std::array<double, kSteps> made{};
    for (std::size_t i = 0; i < kSteps; ++i) made[i] = frictionAt((static_cast<double>(i) + 0.5) / kSteps);
    return made;
  }();
  return all;
}

/// Returns whether the shear has not fallen. \param least Q / P
bool PartialSlip::isLoaded(double normal_N, double least) {
  if (mostNormal_N_ < kAsStrong * normal_N || least > most_) {
    most_ = least;
    mostNormal_N_ = normal_N;
  }
  return least >= kLoaded * most_;
}

/// Adds what a frame says of mu.
void PartialSlip::add(const Observation& contact, double least, std::int64_t time_ns) {
  const double keep = weight_ > 0.0 ? std::exp(-secondsSince(time_ns) / kMemory_s) : 0.0,
               weight = 1.0 / squared(kNew * contact.spreadRatioDeviation);
  last_ns_ = time_ns;
  weight_ = keep * weight_ + weight;
  for (std::size_t i = 0; i < kSteps; ++i) {
    const double expected = spreadRatio(stickRatio(least / frictions()[i]));
    auto& [away, stays] = sums_[i];
    away = keep * away + weight * (contact.spreadRatio - expected);
    stays = keep * stays + weight * (squared(kStays * contact.spreadRatioDeviation) + squared(kModel) +
                                     squared(kModelShare * (expected - 1.0)));
  }
}

/// Computes the probabilities of the steps. Returns that of incipient slip. \param noise deviation of Q / P, as a share
double PartialSlip::weigh(double least, double noise, std::array<double, kSteps>& probability) const {
  for (std::size_t i = 0; i < kSteps; ++i) {
    const auto& [away, stays] = sums_[i];
    const double variance = (1.0 + stays) / weight_;
    const double beyond = std::fmax(0.0, std::log(least / frictions()[i]) / noise);
    probability[i] = -0.5 * (squared(away / weight_) / variance + std::log(variance) + squared(beyond));
  }
  const double most = *std::max_element(probability.begin(), probability.end());
  double sum = 0.0, incipient = 0.0;
  for (double& each : probability) sum += each = std::exp(each - most);
  for (std::size_t i = 0; i < kSteps; ++i) {
    probability[i] /= sum;
    if (least > kIncipient * frictions()[i]) incipient += probability[i];
  }
  return incipient;
}

/// Returns whether the alarm is on after a frame.
bool PartialSlip::alarms(double incipient) {
  sure_ = incipient >= kAlarm ? std::min(sure_ + 1, kFrames) : 0;
  alarm_ = alarm_ ? incipient >= kCalm : sure_ == kFrames;
  return alarm_;
}

std::optional<Slip> PartialSlip::see(const Observation& contact, std::int64_t time_ns,
                                     const std::array<double, 2>& moved_m,
                                     const std::array<double, 2>& movedDeviation_m) {
  const double normal_N = contact.force_N[2], normalDeviation_N = contact.forceDeviation_N[2];
  const double shear_N = std::hypot(contact.force_N[0], contact.force_N[1]);
  const double x = shear_N > 0.0 ? contact.force_N[0] / shear_N : 0.0;
  const double y = shear_N > 0.0 ? contact.force_N[1] / shear_N : 0.0;
  const auto deviationAlong = [x, y](const auto& deviation) { return std::hypot(x * deviation[0], y * deviation[1]); };
  const double shearDeviation_N = deviationAlong(contact.forceDeviation_N);
  const double moved = std::hypot(moved_m[0], moved_m[1]), along = x * moved_m[0] + y * moved_m[1];
  const bool hasMoved = moved > kLeastMotion_m && moved > kSure * std::hypot(movedDeviation_m[0], movedDeviation_m[1]);
  movedFrames_ = hasMoved ? std::min(movedFrames_ + 1, kFrames) : 0;
  if (movedFrames_ == kFrames) weight_ = mostNormal_N_ = 0.0;
  const double least = shear_N / normal_N;
  const bool isSure = normal_N > kSure * normalDeviation_N && shear_N > kSure * shearDeviation_N;
  if (!isSure || !(least < kLargestFriction)) return std::nullopt;
  const bool loaded = isLoaded(normal_N, least);
  if (contact.spreadRatioDeviation > 0.0 && loaded) add(contact, least, time_ns);
  if (weight_ == 0.0 || (loaded && secondsSince(time_ns) > kStale_s)) return std::nullopt;
  std::array<double, kSteps> probability{};
  Slip slip;
  slip.incipient =
      weigh(least, std::hypot(shearDeviation_N / shear_N, normalDeviation_N / normal_N, kBound), probability);
  if (!std::isfinite(slip.incipient)) return std::nullopt;
  const auto quantile = [&](double share) {
    double below = 0.0;
    for (std::size_t i = 0; i < kSteps; ++i) {
      const double next = below + probability[i];
      if (next >= share) return frictionAt((static_cast<double>(i) + (share - below) / probability[i]) / kSteps);
      below = next;
    }
    return kLargestFriction;
  };
  slip.friction = {quantile(0.5), quantile(0.025), quantile(0.975)};
  const auto& [estimate, low, high] = slip.friction;
  slip.stickRatio = {stickRatio(least / estimate), stickRatio(least / low), stickRatio(least / high)};
  slip.margin_N = std::fmax(0.0, estimate * normal_N - shear_N);
  slip.holding_N = kReserve * shear_N / low;
  const bool slides =
      movedFrames_ == kFrames && along > kLeastMotion_m && along > kSure * deviationAlong(movedDeviation_m);
  const bool isAlarm = alarms(slip.incipient);
  if (slip.stickRatio.high - slip.stickRatio.low > kVague) return slip;
  slip.state = slides && slip.incipient > kPossible ? SlipState::kSlipping
               : isAlarm                            ? SlipState::kIncipient
                                                    : SlipState::kSticking;
  return slip;
}

}  // namespace touch
