// Follows contacts from field to field: each has an id from its begin to its end.
//
// Identity. Let the last place of a contact be where it was last seen.
//   1. A contact of a field continues an earlier one if that can have moved there: it lies where position and velocity
//      predict it, within the deviations, and no further from the last place than the greatest speed allows; or its
//      centre jumped, by at most kReach_m or its own radius. Of all ways to pair contacts, the likeliest is
//      taken.
//   2. Contacts that become one continue the contact that is nearest to the common centre, which is the strongest one.
//      A contact that is divided continues in the nearest part. The others end by 3, or begin.
//   3. A contact that a valid field does not show is absent. It continues if it is seen again within memory_s(),
//      at most kReach_m or its radius from its last place; else it ends, in the second valid field or a later one, as
//      lifted, or as merged if another one gained its force when it went. Contacts that part again in that time
//      therefore have their earlier ids.
//   4. While fields are not valid or are missing, a contact is unknown: it may last. It continues by 1 within
//   memory_s(),
//      and after that where it was, within its radius. Not seen for patience_s(), it ends as not seen.
//   5. Contacts end, and others begin, where fields cannot be compared: time did not advance, or the basis changed (a
//      zero, an undone zero, another gel file, a restart).
// Ids increase from 1 and are not used again. Each begin has one end, if endAll() is called at the end of the fields.
#pragma once

#include "touch/field.h"
#include "touch/intervals.h"
#include "touch/partial_slip.h"

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace touch {

/// What an observation states is as last seen, but forces, moments and their covariances are 0 in the phases absent,
/// unknown and end, and so are velocities: they say nothing there.
struct Contact : Observation {
  std::uint64_t id = 0;
  ContactPhase phase = ContactPhase::kBegin;
  EndCause endCause = EndCause::kNone;  ///< in the phase end
  bool doubted = false;                 ///< as the field in which it was last seen
  std::int64_t begun_ns = 0;            ///< time of its first field; age: the time since then
  std::int64_t seen_ns = 0;             ///< time of the last field with it
  double radius_m = 0.0;                ///< of a disc with its area
  double radiusDeviation_m = 0.0;
  std::array<double, 2> velocity_m_s{};
  std::array<double, 2> velocityDeviation_m_s{};
  double angularVelocity_rad_s = 0.0;  ///< of the larger half axis, from x towards y
  double angularVelocityDeviation_rad_s = 0.0;
  std::optional<Slip> slip;  ///< none: not known
};

/// Thread-bound.
class ContactTracker {
 public:
  // Limits of memory_s(), and the least of patience_s().
  static constexpr double kLeastMemory_s = 0.1, kMostMemory_s = 3.0, kLeastPatience_s = 1.0;
  static constexpr double kReach_m = 6e-3;    ///< half of the distance from which on two contacts are told apart
  static constexpr double kTurn_rad_s = 5.0;  ///< deviation of an angular velocity before it is measured

  /// Takes the next field. Returns all contacts, first those that end here, each part by increasing id; valid
  /// until the next call. Where no field comes, one that is not valid, with the time at present, lets contacts end.
  const std::vector<Contact>& update(const Field& field);

  /// Ends all contacts, as stopped: the sensor is another one, or the program stops. Returns as update().
  const std::vector<Contact>& endAll();

  /// Returns the time after which a contact that valid fields do not show has ended: some intervals between valid
  /// fields.
  double memory_s() const;
  /// Returns the time after which a contact ends of which nothing is known.
  double patience_s() const;

 private:
  struct Axis {  ///< position and velocity at the time when the contact was last seen, and their covariance
    double position, velocity, positionVariance, covariance, velocityVariance;

    /// Returns where it leads in a time, under an acceleration with this deviation.
    Axis predicted(double dt, double acceleration) const;
    /// Takes what the position was seen to be more than predicted.
    void correct(double innovation, double variance);
  };
  struct Seen {  ///< where and when
    std::int64_t time_ns = 0;
    std::array<double, 2> position_m{}, deviation_m{};
    std::array<double, 2> shear{};  ///< over the normal force
    double orientation_rad = 0.0, orientationDeviation_rad = 0.0;
  };
  struct Track {
    Contact contact;
    PartialSlip slip;
    std::array<Seen, 2> before{};  ///< kSlipTime_ns to twice that ago, and since
    std::array<Axis, 2> axes{};
    Axis turn{};                         ///< orientation and angular velocity
    double press_N = 0.0, gain_N = 0.0;  ///< normal force as last seen, and how much more that was than before
    bool absent = false;                 ///< in the last valid field
    EndCause absence = EndCause::kNone;  ///< what it went by
  };
  struct Step {   ///< from a contact to an observation
    double cost;  ///< -2 log likelihood, less a constant
    bool jumped;
  };

  static Axis unmoved(double position, double deviation);
  static Axis unturned(const Observation& at);
  Step step(const Track& track, const Observation& to, double dt) const;
  void match(const Field& field);
  bool isMerged(const Track& track) const;
  void begin(const Observation& at, const Field& field);
  void follow(Track& track, const Observation& to, const Field& field) const;
  static void turn(Axis& axis, const Observation& to, double dt);
  static void see(Track& track, const Observation& as, const Field& field, ContactPhase phase);
  static void judgeSlip(Track& track, const Observation& as);
  void end(Track& track, EndCause cause);

  std::vector<Track> tracks_;  ///< by increasing id
  Intervals intervals_;        ///< between valid fields [s]
  std::vector<Contact> reported_;
  Basis basis_;
  std::int64_t last_ns_ = 0;  ///< time of the last valid field
  std::uint64_t lastId_ = 0;
};

}  // namespace touch
