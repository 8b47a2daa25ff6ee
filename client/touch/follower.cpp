#include "client/touch/follower.h"

#include "proto/traction/v1/vectors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace traction::contacts {
namespace {

/// Flags by which errors may exceed what the deviations say.
constexpr std::uint32_t kDoubts = kZeroUnverified | kTorn | kUnexplained | kOutOfRange | kDoubtedOrigin;

/// Largest number of critical points in a message: the strongest.
constexpr std::size_t kMostPoints = 16;

void observe(const Field& field, touch::Field& to) {
  const Header& header = field.header;
  to.time_ns = header.captured_ns != 0 ? header.captured_ns : header.received_ns;
  to.valid = field.valid;
  to.doubted = (header.flags & kDoubts) != 0;
  to.basis = {.boot = header.boot, .calibration = header.calibration, .zero = header.zero};
  to.contacts = field.contacts;
}

void encode(const Covariance& from, v1::Covariance& to) {
  to.mutable_noise()->Add(from.noise.begin(), from.noise.end());
  to.mutable_systematic()->Add(from.systematic.begin(), from.systematic.end());
}

void encode(const Interval& from, v1::Interval& to) {
  to.set_estimate(from.estimate);
  to.set_low(from.low);
  to.set_high(from.high);
}

void encode(const touch::Contact& from, v1::TrackedContact& to) {
  to.set_id(from.id);
  to.set_phase(static_cast<v1::ContactPhase>(from.phase));
  to.set_doubted(from.doubted);
  to.set_begun_ns(from.begun_ns);
  to.set_seen_ns(from.seen_ns);
  setVector(from.position_m, *to.mutable_position_m());
  setVector(from.positionDeviation_m, *to.mutable_position_deviation_m());
  to.set_radius_m(from.radius_m);
  to.set_radius_deviation_m(from.radiusDeviation_m);
  setVector(from.force_N, *to.mutable_force_n());
  setVector(from.forceDeviation_N, *to.mutable_force_deviation_n());
  setVector(from.velocity_m_s, *to.mutable_velocity_m_s());
  setVector(from.velocityDeviation_m_s, *to.mutable_velocity_deviation_m_s());
  setVector(from.moment_Nm, *to.mutable_moment_nm());
  to.set_position_z_m(from.positionZ_m);
  encode(from.forceCovariance_N2, *to.mutable_force_covariance_n2());
  encode(from.momentCovariance_N2m2, *to.mutable_moment_covariance_n2m2());
  encode(from.forceMomentCovariance_N2m, *to.mutable_force_moment_covariance_n2m());
  setVector(from.halfAxes_m, *to.mutable_half_axes_m());
  setVector(from.halfAxesDeviation_m, *to.mutable_half_axes_deviation_m());
  to.set_orientation_rad(from.orientation_rad);
  to.set_orientation_deviation_rad(from.orientationDeviation_rad);
  to.set_end_cause(static_cast<v1::EndCause>(from.endCause));
  to.set_angular_velocity_rad_s(from.angularVelocity_rad_s);
  to.set_angular_velocity_deviation_rad_s(from.angularVelocityDeviation_rad_s);
  if (!from.slip) return;
  v1::Slip& slip = *to.mutable_slip();
  slip.set_state(static_cast<v1::SlipState>(from.slip->state));
  encode(from.slip->stickRatio, *slip.mutable_stick_ratio());
  encode(from.slip->friction, *slip.mutable_friction());
  slip.set_margin_n(from.slip->margin_N);
  slip.set_holding_force_n(from.slip->holdingForce_N);
  slip.set_model(static_cast<v1::SlipModel>(from.slip->model));
}

void encode(const touch::CriticalPoint& from, v1::CriticalPoint& to) {
  to.set_id(from.id);
  to.set_kind(static_cast<v1::CriticalPointKind>(from.kind));
  to.set_index(from.index);
  to.set_begun_ns(from.begun_ns);
  setVector(from.position_m, *to.mutable_position_m());
  setVector(from.positionDeviation_m, *to.mutable_position_deviation_m());
  to.set_strength(from.strength);
  to.set_angle_rad(from.angle_rad);
}

}  // namespace

void Follower::describe(const Description& description) {
  nodes_ = description.body ? Grid{} : description.nodes;
  calibration_ = description.calibration.id;
}

const Grid* Follower::nodesOf(const Field& field) const {
  return field.header.calibration == calibration_ && nodes_.columns > 0 ? &nodes_ : nullptr;
}

const v1::Contacts& Follower::take(const Field& field, std::string_view bytes) {
  field_.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));  // it was decoded before
  message_.mutable_header()->Swap(field_.mutable_header());
  arrived_ns_ = field.header.arrived_ns;
  observe(field, observed_);
  time_ns_ = observed_.time_ns;
  std::vector<touch::CriticalPoint> points;
  if (field.header.calibration == calibration_) {
    points = touch::criticalPoints({.columns = static_cast<int>(nodes_.columns),
                                    .rows = static_cast<int>(nodes_.rows),
                                    .pitch_m = nodes_.pitch_m,
                                    .centre_m = nodes_.centre_m,
                                    .force_N = field.force_N,
                                    .deviation_N = field.nodeDeviation_N});
    points.resize(std::min(points.size(), kMostPoints));
  }
  const std::vector<touch::Contact>& contacts = tracker_.update(observed_);
  return fill(contacts, pointTracker_.update(observed_, points, tracker_.memory_s()), field.valid,
              field.header.receivedReal_ns);
}

std::int64_t Follower::silence_ns() const {
  return std::llround(1e9 * std::min(tracker_.memory_s(), 0.5));
}

const v1::Contacts& Follower::wait(std::int64_t now_ns) {
  touch::Field none;
  none.time_ns = observed_.time_ns + (now_ns - arrived_ns_);  // on the clock of fields, which may be another host's
  time_ns_ = none.time_ns;
  return fill(tracker_.update(none), {}, false, options_.realClock());
}

const v1::Contacts& Follower::endAll() {
  return fill(tracker_.endAll(), {}, false, options_.realClock());
}

const v1::Contacts& Follower::fill(const std::vector<touch::Contact>& contacts,
                                   const std::vector<touch::CriticalPoint>& points, bool valid, std::int64_t real_ns) {
  contacts_ = &contacts;
  message_.set_timestamp(1e-9 * static_cast<double>(real_ns));
  message_.set_run(options_.run.data(), options_.run.size());
  message_.set_valid(valid);
  message_.clear_contacts();
  for (const touch::Contact& contact : contacts) encode(contact, *message_.add_contacts());
  message_.clear_critical_points();
  for (const touch::CriticalPoint& point : points) encode(point, *message_.add_critical_points());
  hasContacts_ = std::any_of(contacts.begin(), contacts.end(),
                             [](const touch::Contact& each) { return each.phase != ContactPhase::kEnd; });
  message_.mutable_header()->set_sequence(++sequence_);
  message_.mutable_header()->set_sent_ns(options_.monotonicClock());
  return message_;
}

}  // namespace traction::contacts
