// Each contact is followed by three Kalman filters, along x and y and of its orientation, of position and velocity
// under an acceleration that is constant from one field to the next. What a contact may have become is weighed by
// likelihood: it moved, it jumped (contacts became one, or one was divided), or it ended and another one began.
#include "touch/contact_tracker.h"

#include "touch/assignment.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace touch {
namespace {

/// Cost of an end and a begin in one frame instead of a step: each happens once a second at 60 frames/s, the begin
/// anywhere on 100 x 75 mm. -2 log(1/60 * 1/60 / 0.0075 m^2), less the 2 log(2 pi) that steps leave out.
constexpr double kEndAndBegin = 2.9;
/// Cost of a jump: once in ten seconds. -2 log(1/600).
constexpr double kJump = 12.8;
/// Cost of what is impossible. Ending and beginning always costs less.
constexpr double kNever = 1000.0;
/// Deviations within which a step lies.
constexpr double kDeviations = 5.0;
constexpr double kLeastVariance_m2 = 1e-12;    ///< of a place: numbers are single-precision in the solver
constexpr double kLeastVariance_rad2 = 1e-12;  ///< of an orientation

/// Deviation of what an orientation was seen to be more than predicted from which on half a turn, which looks the same
/// as none, may be mistaken [rad]: a quarter turn is three of it.
constexpr double kClear_rad = 0.5;

constexpr double kGreatestSpeed_m_s =
    0.5;  ///< of a contact; half of it is the deviation of a velocity before it is measured
constexpr double kAcceleration_m_s2 = 3.0;  ///< deviation; a finger that draws circles of 15 mm twice a second has 2.4
/// Deviation. A finger that turns to and fro by a right angle twice a second has 88, for many fields in succession.
constexpr double kAngularAcceleration_rad_s2 = 155.0;

/// Time over which a contact that slips is seen to move [ns].
constexpr std::int64_t kSlipTime_ns = 100'000'000;

/// Way by which the pressure's centre goes along the shear of a contact that sticks, over its radius, for each unit of
/// shear over normal force; and its deviation. CalculiX: 0.07 of a ball and a flat punch, 0.11 of a bar and a cylinder
/// (tests/evaluation/friction.py).
constexpr double kSway = 0.09, kSwayDeviation = 0.04;

double square(double x) {
  return x * x;
}

double radius(const Observation& of) {
  return std::sqrt(std::max(of.area_m2, 0.0) / std::numbers::pi);
}

double variance(double deviation) {
  return std::max(square(deviation), kLeastVariance_m2);
}

/// Leaves out of a contact what holds only for a field in which it is seen.
void withdraw(Contact& contact, ContactPhase phase) {
  contact.phase = phase;
  contact.force_N = contact.forceDeviation_N = contact.moment_Nm = {};
  contact.forceCovariance_N2 = contact.momentCovariance_N2m2 = contact.forceMomentCovariance_N2m = {};
  contact.velocity_m_s = contact.velocityDeviation_m_s = {};
  contact.angularVelocity_rad_s = contact.angularVelocityDeviation_rad_s = 0.0;
  contact.slip.reset();
}

}  // namespace

double ContactTracker::memory_s() const {
  return std::clamp(kPatientIntervals * intervals_.median(0.0), kLeastMemory_s, kMostMemory_s);
}

double ContactTracker::patience_s() const {
  return std::max(kLeastPatience_s, 2.0 * memory_s());
}

const std::vector<Contact>& ContactTracker::update(const Field& field) {
  reported_.clear();
  const bool advances = field.valid ? field.time_ns > last_ns_ : field.time_ns >= last_ns_;
  const bool comparable = advances && (!field.valid || field.basis == basis_);
  const EndCause cause = comparable                                    ? EndCause::kNotSeen
                         : advances && field.basis.boot == basis_.boot ? EndCause::kZero
                                                                       : EndCause::kStopped;
  if (!comparable) intervals_.clear();
  if (comparable && field.valid && last_ns_ != 0) intervals_.add(seconds(last_ns_, field.time_ns));
  std::erase_if(tracks_, [&](Track& track) {
    if (comparable && seconds(track.contact.seen_ns, field.time_ns) <= patience_s()) return false;
    end(track, cause);
    return true;
  });
  if (field.valid) {
    match(field);
    basis_ = field.basis;
    last_ns_ = field.time_ns;
  } else {
    for (Track& track : tracks_) withdraw(track.contact, ContactPhase::kUnknown);
  }
  std::ranges::sort(reported_, {}, &Contact::id);
  for (const Track& track : tracks_) reported_.push_back(track.contact);
  return reported_;
}

const std::vector<Contact>& ContactTracker::endAll() {
  reported_.clear();
  for (Track& track : tracks_) end(track, EndCause::kStopped);
  tracks_.clear();
  return reported_;
}

void ContactTracker::end(Track& track, EndCause cause) {
  withdraw(track.contact, ContactPhase::kEnd);
  track.contact.endCause = cause;
  reported_.push_back(track.contact);
}

ContactTracker::Axis ContactTracker::unmoved(double position, double deviation) {
  return {position, 0.0, variance(deviation), 0.0, square(0.5 * kGreatestSpeed_m_s)};
}

ContactTracker::Axis ContactTracker::unturned(const Observation& at) {
  return {at.orientation_rad, 0.0, square(at.orientationDeviation_rad), 0.0, square(kTurn_rad_s)};
}

ContactTracker::Axis ContactTracker::Axis::predicted(double dt, double acceleration) const {
  const double speed = square(acceleration * dt);  // variance that the acceleration adds
  return {position + dt * velocity, velocity,
          positionVariance + dt * (2.0 * covariance + dt * velocityVariance) + 0.25 * dt * dt * speed,
          covariance + dt * velocityVariance + 0.5 * dt * speed, velocityVariance + speed};
}

void ContactTracker::Axis::correct(double innovation, double variance) {
  const double total = positionVariance + variance;
  const double gain = positionVariance / total, velocityGain = covariance / total;
  *this = {position + gain * innovation, velocity + velocityGain * innovation, (1.0 - gain) * positionVariance,
           (1.0 - gain) * covariance, velocityVariance - velocityGain * covariance};
}

ContactTracker::Step ContactTracker::step(const Track& track, const Observation& to, double dt) const {
  const bool isLate = dt > memory_s();  // it may have gone anywhere: only where it was, it is the same
  const double reach = std::max({isLate ? 0.0 : kReach_m, track.contact.radius_m, radius(to)});
  double moved = 0.0, jumped = kJump, distance2 = 0.0, noise = 0.0;
  for (int i = 0; i < 2; ++i) {
    const Axis& last = track.axes[i];
    const Axis next = last.predicted(dt, kAcceleration_m_s2);
    const double observed = variance(to.positionDeviation_m[i]);
    const double moving = next.positionVariance + observed;
    const double jumping = last.positionVariance + observed + square(reach / 3.0);
    moved += square(to.position_m[i] - next.position) / moving + std::log(moving);
    jumped += square(to.position_m[i] - last.position) / jumping + std::log(jumping);
    distance2 += square(to.position_m[i] - last.position);
    noise = std::max(noise, last.positionVariance + observed);
  }
  const double distance = std::sqrt(distance2) - kDeviations * std::sqrt(noise);
  if (isLate || track.absent || distance > kGreatestSpeed_m_s * dt) moved = kNever;
  if (distance > reach) jumped = kNever;
  return {std::min({moved, jumped, kNever}), jumped < moved};
}

void ContactTracker::match(const Field& field) {
  constexpr std::size_t kMostObservations = 8;  // as many as a field lists; a foreign one may list any number
  const int observations = static_cast<int>(std::min(field.contacts.size(), kMostObservations));
  const int known = static_cast<int>(tracks_.size());
  // Beyond the known contacts each observation has a column in which it is a contact that begins.
  Eigen::MatrixXd cost = Eigen::MatrixXd::Constant(observations, known + observations, kEndAndBegin);
  for (int row = 0; row < observations; ++row) {
    for (int column = 0; column < known; ++column) {
      const Track& track = tracks_[column];
      cost(row, column) = step(track, field.contacts[row], seconds(track.contact.seen_ns, field.time_ns)).cost;
    }
  }
  for (Track& track : tracks_) withdraw(track.contact, ContactPhase::kAbsent);
  const std::vector<int> pairs = assign(cost);
  for (int row = 0; row < observations; ++row) {
    if (pairs[row] < known) {
      follow(tracks_[pairs[row]], field.contacts[row], field);
    } else {
      begin(field.contacts[row], field);
    }
  }
  std::erase_if(tracks_, [&](Track& track) {
    const bool wasAbsent = track.absent;
    track.absent = track.contact.phase == ContactPhase::kAbsent;
    if (!track.absent) return false;
    if (!wasAbsent) track.absence = isMerged(track) ? EndCause::kMerged : EndCause::kLifted;
    if (!wasAbsent || seconds(track.contact.seen_ns, field.time_ns) <= memory_s()) return false;
    end(track, track.absence);
    return true;
  });
}

/// Returns whether another contact, which now reaches to where this one was, has gained its force in this field.
bool ContactTracker::isMerged(const Track& track) const {
  return std::ranges::any_of(tracks_, [&](const Track& other) {
    const std::array<double, 2>&at = track.contact.position_m, &there = other.contact.position_m;
    const double reach = std::max(other.contact.radius_m, other.contact.halfAxes_m[0]) + track.contact.radius_m;
    return other.contact.force_N[2] > 0.0 && other.gain_N > 0.5 * track.press_N &&
           std::hypot(at[0] - there[0], at[1] - there[1]) < reach;
  });
}

void ContactTracker::begin(const Observation& at, const Field& field) {
  Track& track = tracks_.emplace_back();
  track.contact.id = ++lastId_;
  track.contact.begun_ns = field.time_ns;
  for (int i = 0; i < 2; ++i) track.axes[i] = unmoved(at.position_m[i], at.positionDeviation_m[i]);
  track.turn = unturned(at);
  see(track, at, field, ContactPhase::kBegin);
}

void ContactTracker::follow(Track& track, const Observation& to, const Field& field) const {
  const double dt = seconds(track.contact.seen_ns, field.time_ns);
  const bool jumped = step(track, to, dt).jumped;
  if (jumped) {
    track.slip = {};
    track.before = {};
  }
  for (int i = 0; i < 2; ++i) {
    Axis& axis = track.axes[i];
    if (jumped) {
      axis = unmoved(to.position_m[i], to.positionDeviation_m[i]);
      continue;
    }
    axis = axis.predicted(dt, kAcceleration_m_s2);
    axis.correct(to.position_m[i] - axis.position, variance(to.positionDeviation_m[i]));
  }
  if (jumped)
    track.turn = unturned(to);
  else
    turn(track.turn, to, dt);
  see(track, to, field, ContactPhase::kMove);
}

/// Follows an orientation, which begins anew where half a turn may be mistaken: of a round contact, always.
void ContactTracker::turn(Axis& axis, const Observation& to, double dt) {
  const Axis next = axis.predicted(dt, kAngularAcceleration_rad_s2);
  const double seen = std::max(square(to.orientationDeviation_rad), kLeastVariance_rad2);
  if (next.positionVariance + seen > square(kClear_rad)) {
    axis = unturned(to);
    return;
  }
  axis = next;
  axis.correct(std::remainder(to.orientation_rad - axis.position, std::numbers::pi), seen);
}

void ContactTracker::see(Track& track, const Observation& as, const Field& field, ContactPhase phase) {
  Contact& contact = track.contact;
  static_cast<Observation&>(contact) = as;
  contact.phase = phase;
  contact.doubted = field.doubted;
  contact.seen_ns = field.time_ns;
  track.gain_N = as.force_N[2] - std::exchange(track.press_N, as.force_N[2]);
  contact.radius_m = radius(as);
  // d sqrt(A / pi) = dA / (2 pi r)
  contact.radiusDeviation_m =
      contact.radius_m > 0.0 ? as.areaDeviation_m2 / (2.0 * std::numbers::pi * contact.radius_m) : 0.0;
  for (int i = 0; i < 2; ++i) {
    contact.velocity_m_s[i] = track.axes[i].velocity;
    contact.velocityDeviation_m_s[i] = std::sqrt(track.axes[i].velocityVariance);
  }
  contact.angularVelocity_rad_s = track.turn.velocity;
  contact.angularVelocityDeviation_rad_s = std::sqrt(track.turn.velocityVariance);
  judgeSlip(track, as);
}

/// Says what a contact that was just seen shows of slip.
void ContactTracker::judgeSlip(Track& track, const Observation& as) {
  Seen now{track.contact.seen_ns,      as.position_m, as.positionDeviation_m, {}, as.orientation_rad,
           as.orientationDeviation_rad};
  if (as.force_N[2] > 0.0) now.shear = {as.force_N[0] / as.force_N[2], as.force_N[1] / as.force_N[2]};
  auto& [before, since] = track.before;
  if (now.time_ns - since.time_ns >= kSlipTime_ns) {
    before = since.time_ns == 0 ? now : since;
    since = now;
  }
  Motion moved;
  for (std::size_t i = 0; i < moved.way_m.size(); ++i) {
    const double sheared_m = track.contact.radius_m * (now.shear[i] - before.shear[i]);
    moved.way_m[i] = now.position_m[i] - before.position_m[i] - kSway * sheared_m;
    moved.wayDeviation_m[i] = std::hypot(now.deviation_m[i], before.deviation_m[i], kSwayDeviation * sheared_m);
  }
  moved.turn_rad = std::remainder(now.orientation_rad - before.orientation_rad, std::numbers::pi);
  moved.turnDeviation_rad = std::hypot(now.orientationDeviation_rad, before.orientationDeviation_rad);
  track.contact.slip = track.slip.see(as, now.time_ns, moved);
}

}  // namespace touch
