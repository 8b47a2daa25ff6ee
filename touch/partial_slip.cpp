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

/// The shear has not fallen while L / P is at least this share of the largest one of a contact that bore at least so
/// much of the present normal force.
constexpr double kLoaded = 0.95, kAsStrong = 0.5;

/// How far L / P may exceed the friction besides its noise, as a deviation and a share: the two are not seen alike.
constexpr double kBound = 0.005;

/// Normal force that is held for each that is needed.
constexpr double kReserve = 1.25;

/// Width of the interval of a stick ratio from which on nothing is known of it.
constexpr double kVague = 0.8;

/// Frames that must show the same of a motion or an alarm: one frame may be off, as where it was solved in another way.
constexpr int kFrames = 2;

/// A contact has moved if it has by more than this, and by kSure deviations: way [m], turn [rad]. It is along the shear
/// from this cosine of the angle between them on.
constexpr double kLeastMotion_m = 2e-4, kLeastTurn_rad = 0.05, kAlong = 0.8;

/// A contact may bear no more if that is so probable.
constexpr double kPossible = 0.05;

/// Mean distance of a pressure from its centre, over the mean radius of its ellipse: 0.62 of a ball, 0.67 - 0.69 of an
/// even pressure, disc or bar, with rounded edges 0.74 - 0.80 of a bar, 0.73 - 0.77 of a flat punch, 0.68 - 0.72 of a
/// cylinder on its side (tests/evaluation/friction.py); and the deviation of that as a share.
constexpr double kLever = 0.75, kLeverShare = 0.12;

/// Deviation of the load at which shear and torque slip together, as a share, where they are alike: it lies 11 % below
/// the ellipse to 7 % above. Measured: docs/decisions/0052-slip-without-a-ball.md.
constexpr double kMixed = 0.08;

/// Torque over shear (T / r over Q) from which on the spread of the shear is not that of Mindlin.
constexpr double kTorque = 0.3;

/// Deviations within which 95 % are.
constexpr double kInterval = 1.96;

/// Friction while a contact slides, as a deviation of ln mu: it depends on speed and place.
constexpr double kSlides = 0.05;

/// Friction of rubber falls with the normal force, by this power at most: that of a ball's area.
constexpr double kByNormal = 1.0 / 3.0;

/// Time in which the weight of a frame of a slide decays to 1 / e, and after which another slide begins [s].
constexpr double kSlideMemory_s = 0.2, kNextSlide_s = 0.3;

/// A contact whose load over normal force has fallen below this part of what it was in its slide no longer slides.
constexpr double kLetGo = 0.9;

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

PartialSlip::Load PartialSlip::loadOf(const Observation& contact) {
  const auto& [x, y, normal_N] = contact.force_N;
  Load load;
  load.shear_N = std::hypot(x, y);
  const double long_m = contact.halfAxes_m[0], short_m = contact.halfAxes_m[1];
  // Perimeter of the ellipse over 2 pi (Ramanujan).
  const double lever_m =
      0.5 * kLever * (3.0 * (long_m + short_m) - std::sqrt((3.0 * long_m + short_m) * (long_m + 3.0 * short_m)));
  double torqueDeviation_N = 0.0, lever = 0.0;
  if (lever_m > 0.0) {
    load.torque_N = std::fabs(contact.moment_Nm[2]) / lever_m;
    torqueDeviation_N = std::sqrt(std::fmax(0.0, contact.momentCovariance_N2m2.noise[8])) / lever_m;
    lever = std::hypot(kLeverShare,
                       std::hypot(contact.halfAxesDeviation_m[0], contact.halfAxesDeviation_m[1]) / (long_m + short_m));
  }
  load.all_N = std::hypot(load.shear_N, load.torque_N);
  if (load.all_N == 0.0) return load;
  load.deviation_N =
      std::hypot(x * contact.forceDeviation_N[0], y * contact.forceDeviation_N[1], load.torque_N * torqueDeviation_N) /
      load.all_N;
  load.least = load.all_N / normal_N;
  load.noise = std::hypot(load.deviation_N / load.all_N, contact.forceDeviation_N[2] / normal_N, kBound);
  const double byTorque = squared(load.torque_N / load.all_N);
  load.form = std::hypot(lever * byTorque, 2.0 * kMixed * std::sqrt(byTorque * (1.0 - byTorque)));
  return load;
}

double PartialSlip::Load::low() const {
  return least * std::exp(-kInterval * logDeviation());
}

/// Returns whether the contact has moved along its load. Forgets what was known of another place, but nothing of a
/// slide that may still be seen.
bool PartialSlip::slides(const Observation& contact, const Load& load, std::int64_t time_ns, const Motion& moved) {
  const auto& [x, y, normal_N] = contact.force_N;
  const double torque_Nm = contact.moment_Nm[2];
  const double way_m = std::hypot(moved.way_m[0], moved.way_m[1]);
  const bool hasMoved =
      way_m > kLeastMotion_m && way_m > kSure * std::hypot(moved.wayDeviation_m[0], moved.wayDeviation_m[1]);
  const bool hasTurned =
      std::fabs(moved.turn_rad) > kLeastTurn_rad && std::fabs(moved.turn_rad) > kSure * moved.turnDeviation_rad;
  movedFrames_ = hasMoved || hasTurned ? std::min(movedFrames_ + 1, kFrames) : 0;
  if (movedFrames_ < kFrames) return false;
  weight_ = mostNormal_N_ = 0.0;
  const double along_Nm = x * moved.way_m[0] + y * moved.way_m[1];
  const bool isAlong = (hasMoved && along_Nm > kAlong * way_m * load.shear_N) ||
                       (hasTurned && moved.turn_rad * torque_Nm > 0.0 && load.torque_N > kTorque * load.shear_N);
  if (!isAlong && seconds(slide_.last_ns, time_ns) > kNextSlide_s) slide_ = {};
  return isAlong;
}

/// Returns whether the load has not fallen.
bool PartialSlip::isLoaded(double normal_N, const Load& load) {
  if (mostNormal_N_ < kAsStrong * normal_N) most_ = borne_ = 0.0;
  borne_ = std::fmax(borne_, load.low());
  if (load.least > most_) {
    most_ = load.least;
    mostNormal_N_ = normal_N;
  }
  return load.least >= kLoaded * most_;
}

/// Adds what a frame of a slide says of mu.
void PartialSlip::addSlide(const Load& load, double normal_N, std::int64_t time_ns) {
  const double since_s = seconds(slide_.last_ns, time_ns);
  if (since_s > kNextSlide_s) slide_ = {};
  const double logFriction = std::log(load.least);
  if (slide_.weight > 0.0 && logFriction < slide_.logFriction + std::log(kLetGo)) return;
  const double weight = 1.0 / squared(load.noise);
  slide_.weight = slide_.weight * std::exp(-since_s / kSlideMemory_s) + weight;
  slide_.logFriction += weight / slide_.weight * (logFriction - slide_.logFriction);
  slide_.logNormal += weight / slide_.weight * (std::log(normal_N) - slide_.logNormal);
  slide_.deviation = std::hypot(kSlides, load.form);
  slide_.last_ns = time_ns;
}

/// Returns the deviation of the logarithm of the friction of the slide.
double PartialSlip::slideDeviation(double normal_N) const {
  return std::hypot(slide_.deviation, 0.5 * kByNormal * (std::log(normal_N) - slide_.logNormal),
                    std::sqrt(1.0 / slide_.weight));
}

/// Returns the friction that the contact has shown at least, at a normal force.
double PartialSlip::surelyBorne(double normal_N) const {
  return borne_ * std::pow(std::fmin(1.0, mostNormal_N_ / normal_N), kByNormal);
}

/// Adds what a frame says of mu.
void PartialSlip::add(const Observation& contact, double least, std::int64_t time_ns) {
  const double keep = weight_ > 0.0 ? std::exp(-seconds(last_ns_, time_ns) / kMemory_s) : 0.0,
               weight = 1.0 / squared(kNew * contact.shearSpreadRatioDeviation);
  last_ns_ = time_ns;
  weight_ = keep * weight_ + weight;
  for (std::size_t i = 0; i < kSteps; ++i) {
    const double expected = spreadRatio(stickRatio(least / frictions()[i]));
    auto& [away, stays] = sums_[i];
    away = keep * away + weight * (contact.shearSpreadRatio - expected);
    stays = keep * stays + weight * (squared(kStays * contact.shearSpreadRatioDeviation) + squared(kModel) +
                                     squared(kModelShare * (expected - 1.0)));
  }
}

/// Computes the probabilities of the steps, by the slide if there was one. Returns that of incipient slip.
double PartialSlip::weigh(const Load& load, double normal_N, std::array<double, kSteps>& probability) const {
  const double least = load.least, bound = std::fmax(least, surelyBorne(normal_N));
  const double deviation = slide_.weight > 0.0 ? slideDeviation(normal_N) : 0.0;
  for (std::size_t i = 0; i < kSteps; ++i) {
    const double beyond = std::fmax(0.0, std::log(bound / frictions()[i]) / load.logDeviation());
    if (slide_.weight > 0.0) {
      probability[i] = -0.5 * (squared((std::log(frictions()[i]) - slide_.logFriction) / deviation) + squared(beyond));
      continue;
    }
    const auto& [away, stays] = sums_[i];
    const double variance = (1.0 + stays) / weight_;
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

/// States the friction, and what follows from it.
void PartialSlip::judge(const Load& load, double normal_N, Slip& slip) const {
  if (slip.model == SlipModel::kBound) {
    const double bound = std::fmax(surelyBorne(normal_N), load.low());
    slip.friction = {bound, bound, kLargestFriction};
  } else {
    std::array<double, kSteps> probability{};
    slip.incipient = weigh(load, normal_N, probability);
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
  }
  const auto& [estimate, low, high] = slip.friction;
  slip.stickRatio = {stickRatio(load.least / estimate), stickRatio(load.least / low), stickRatio(load.least / high)};
  slip.margin_N = std::fmax(0.0, estimate * normal_N - load.all_N);
  slip.holdingForce_N = kReserve * load.all_N / low;
}

std::optional<Slip> PartialSlip::see(const Observation& contact, std::int64_t time_ns, const Motion& moved) {
  const double normal_N = contact.force_N[2];
  const Load load = loadOf(contact);
  const bool isSliding = slides(contact, load, time_ns, moved);
  const bool isSure =
      normal_N > kSure * contact.forceDeviation_N[2] && load.all_N > kSure * load.deviation_N && load.all_N > 0.0;
  if (!isSure || !(load.least < kLargestFriction)) return std::nullopt;
  const bool loaded = isLoaded(normal_N, load);
  if (contact.shearSpreadRatioDeviation > 0.0 && loaded && load.torque_N < kTorque * load.shear_N)
    add(contact, load.least, time_ns);
  if (isSliding) addSlide(load, normal_N, time_ns);
  const bool bearsMore =
      slide_.weight > 0.0 && std::log(borne_) > slide_.logFriction + kSure * slideDeviation(normal_N);
  if (bearsMore) slide_ = {};
  const bool isStale = loaded && seconds(last_ns_, time_ns) > kStale_s;
  Slip slip;
  slip.model = slide_.weight > 0.0         ? SlipModel::kSliding
               : weight_ > 0.0 && !isStale ? SlipModel::kBall
                                           : SlipModel::kBound;
  judge(load, normal_N, slip);
  if (!std::isfinite(slip.incipient)) return std::nullopt;
  if (slip.model == SlipModel::kBound) return slip;
  const bool isAlarm = alarms(slip.incipient);
  if (slip.stickRatio.high - slip.stickRatio.low > kVague) return slip;
  slip.state = isSliding && slip.incipient > kPossible ? SlipState::kSlipping
               : isAlarm                               ? SlipState::kIncipient
                                                       : SlipState::kSticking;
  return slip;
}

}  // namespace touch
