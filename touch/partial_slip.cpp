#include "touch/partial_slip.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace touch {
namespace {

constexpr int kSteps = 256;  // of the friction's logarithm

/// Deviations from which on a force is sure.
constexpr double kSure = 3.0;

/// How far R of a ball on a real gel lies from Mindlin's, as a deviation: of itself, and as a share of R - 1. Contacts
/// with friction by finite elements (docs/accuracy.md) differ by 0.02 at 60 % of slipping and beyond, by 0.06 at 30 %.
constexpr double kModel = 0.02, kModelShare = 0.1;

/// Normal force that is held for each that is needed.
constexpr double kReserve = 1.25;

/// Width of the interval of a stick ratio from which on nothing is known of it.
constexpr double kVague = 0.8;

/// A contact has moved along its shear if it has by more than this [m] and by kSure deviations; it may bear no more
/// shear if that is so probable.
constexpr double kLeastMotion_m = 2e-4, kPossible = 0.05;

/// Share of the shear at which a contact slips from which on it is about to.
constexpr double kIncipient = 0.9;

/// Quantile `share` of steps with these probabilities, between their places; `at` gives the place of a fraction of the
/// steps.
template <typename At>
double quantile(const std::array<double, kSteps>& probability, double share, At at) {
  double sum = 0.0;
  for (std::size_t i = 0; i < probability.size(); ++i) {
    if (sum + probability[i] >= share) {
      const double inside = probability[i] > 0.0 ? (share - sum) / probability[i] : 0.0;
      return at((static_cast<double>(i) + inside) / kSteps);
    }
    sum += probability[i];
  }
  return at(1.0);
}

}  // namespace

double spreadRatio(double stickRatio) {
  // Without the division by 1 - c / a, of both.
  const double s = stickRatio, s2 = s * s;
  return (1.0 + s + s2 + s2 * s + s2 * s2) / (1.0 + s + s2);
}

std::optional<Slip> partialSlip(const Observation& contact, const std::array<double, 2>& moved_m,
                                const std::array<double, 2>& movedDeviation_m) {
  const double normal_N = contact.force_N[2], normalDeviation_N = contact.forceDeviation_N[2];
  const double shear_N = std::hypot(contact.force_N[0], contact.force_N[1]);
  const double x = shear_N > 0.0 ? contact.force_N[0] / shear_N : 0.0;
  const double y = shear_N > 0.0 ? contact.force_N[1] / shear_N : 0.0;
  const auto deviationAlong = [x, y](const auto& deviation) { return std::hypot(x * deviation[0], y * deviation[1]); };
  const double shearDeviation_N = deviationAlong(contact.forceDeviation_N);
  const bool isSure =
      normal_N > kSure * normalDeviation_N && shear_N > kSure * shearDeviation_N && contact.spreadRatioDeviation > 0.0;
  const double least = shear_N / normal_N;
  if (!isSure || !(least < kLargestFriction)) return std::nullopt;
  // Steps from kLargestFriction down to the friction at which all slips.
  const double range = std::log(kLargestFriction / least);
  const auto frictionAt = [&](double fraction) { return kLargestFriction * std::exp(-range * fraction); };
  const auto stickAt = [&](double fraction) { return std::cbrt(std::fmax(0.0, 1.0 - least / frictionAt(fraction))); };
  std::array<double, kSteps> probability{};
  double sum = 0.0, incipient = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double fraction = (i + 0.5) / kSteps, expected = spreadRatio(stickAt(fraction));
    const double deviation = std::hypot(contact.spreadRatioDeviation, kModel, kModelShare * (expected - 1.0));
    const double away = (contact.spreadRatio - expected) / deviation;
    const double likelihood = std::exp(-0.5 * away * away) / deviation;
    probability[static_cast<std::size_t>(i)] = likelihood;
    sum += likelihood;
    if (least / frictionAt(fraction) > kIncipient) incipient += likelihood;
  }
  if (!(sum > 0.0)) return std::nullopt;
  for (double& each : probability) each /= sum;
  Slip slip;
  slip.incipient = incipient / sum;
  const auto between = [&](double share, auto at) { return quantile(probability, share, at); };
  slip.stickRatio = {between(0.5, stickAt), between(0.975, stickAt), between(0.025, stickAt)};
  slip.friction = {between(0.5, frictionAt), between(0.975, frictionAt), between(0.025, frictionAt)};
  // Widen by the noise of the forces' ratio, which shifts all frictions alike.
  const double noise = 1.96 * std::hypot(shearDeviation_N / shear_N, normalDeviation_N / normal_N);
  const auto widened = [&](double end) {
    const double away = std::log(end / slip.friction.estimate);
    return slip.friction.estimate * std::exp(std::copysign(std::hypot(away, noise), away));
  };
  slip.friction.low = widened(slip.friction.low);
  slip.friction.high = std::fmin(widened(slip.friction.high), kLargestFriction);
  slip.margin_N = slip.friction.estimate * normal_N - shear_N;
  slip.holding_N = kReserve * shear_N / slip.friction.low;
  const double moved = x * moved_m[0] + y * moved_m[1];
  const bool hasMoved = moved > kLeastMotion_m && moved > kSure * deviationAlong(movedDeviation_m);
  if (slip.stickRatio.high - slip.stickRatio.low > kVague) return slip;
  slip.state = hasMoved && slip.incipient > kPossible ? SlipState::kSlipping
               : slip.incipient >= 0.5                ? SlipState::kIncipient
                                                      : SlipState::kSticking;
  return slip;
}

}  // namespace touch
