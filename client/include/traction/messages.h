// The messages that tractiond, and traction-touch, publish for each frame.
//
// Gel frame: right-handed, origin on the touched surface at the centre of the marker field; x points right and y up in
// the camera's picture, z into the gel, towards the camera. A force is the force of the object on the gel: pressing is
// +z.
// Pixels: (0, 0) is the centre of the top left pixel, u points right, v down.
// SI units. No number is NaN or infinite: an invalid value is marked as invalid and is 0.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace traction {

using Id = std::array<std::uint8_t, 16>;  ///< a hash or a random number; all zero: none
using Vector2 = std::array<double, 2>;    ///< x, y
using Vector3 = std::array<double, 3>;    ///< x, y, z

/// Bits of Header::flags. Each is a reason for caution.
enum Flag : std::uint32_t {
  kZeroUnverified = 1,  ///< neither an operator nor an unloaded picture has confirmed the zero
  kFewMarkers = 2,      ///< too few markers are found; the field is not valid
  kDiscontinuity = 4,   ///< the frame before this one has no field, or a clock jumped
  kReacquiring = 8,     ///< markers were labelled anew in this frame
  kTorn = 16,           ///< the picture is inconsistent: some rows are shifted or belong to another frame
  kUnexplained = 32,    ///< the picture shows displacements that no forces on the surface can cause
  kOutOfRange = 64,     ///< the forces exceed the range in which the uncertainty is known
  kGelMismatch = 128,   ///< the rest picture contradicts the gel file; the field is not valid
  /// Packets of the picture arrived twice: they may be another sender's.
  kDoubtedOrigin = 256,
  /// No model of an earlier frame holds, and its own solution did not come in time; the field is not valid.
  kNotSolved = 512,
  /// The gel has yet to recover from earlier loads, or heat may have bent it: a force as small as what is not known of
  /// that is not stated.
  kRecovering = 1024,
  kGelUnverified = 2048,  ///< the gel has too few markers to verify its gel file; deviations are wider
};

/// A 3 x 3 matrix, row by row, indices in the order x, y, z.
using Matrix3 = std::array<double, 9>;

/// A covariance in two parts. The total is their sum.
struct Covariance {
  Matrix3 noise{};       ///< part that differs from frame to frame
  Matrix3 systematic{};  ///< part that does not: uncertainty of the gel file, and force beyond the outermost nodes
};

/// How the forces of a field were found.
enum class Method : std::uint8_t {
  kNone,       ///< not valid, or not reported
  kNoContact,  ///< nothing exceeds the detection limit (see Solver); all forces are 0
  kContact,    ///< something touches
  // Of earlier daemons alone, whose recordings have them.
  kWholeFace,  ///< all nodes were solved for: the contact was large, or contacts did not explain the picture
  kBlend,      ///< weighted mean of the two above
};

/// Whose model the forces of a field were found with.
enum class Solution : std::uint8_t {
  kNone,    ///< not valid, or not reported
  kFull,    ///< this frame's own
  kLinear,  ///< that of an earlier frame, Field::modelFrame, which this one does not contradict
};

/// A region in which something touches the gel. Deviations are standard deviations that noise alone causes.
struct Contact {
  Vector2 position_m{};  ///< centre of its normal forces (of all its forces if it does not press), gel frame
  Vector2 positionDeviation_m{};
  Vector3 force_N{};  ///< gel frame
  Vector3 forceDeviation_N{};
  double area_m2 = 0.0;  ///< area of a uniform pressure of the same concentration
  double areaDeviation_m2 = 0.0;
  // All 0 if the daemon does not report them.
  Vector3 moment_Nm{};       ///< of its forces about its point (position_m, positionZ_m), gel frame
  double positionZ_m = 0.0;  ///< z of that centre: where the surface is curved; of a block 0
  Covariance forceCovariance_N2{};
  Covariance momentCovariance_N2m2{};      ///< of the moment about that point
  Covariance forceMomentCovariance_N2m{};  ///< row: component of the force; column: of the moment
  /// Of the ellipse of an even pressure with this area and the second moments of the forces, the larger one first.
  Vector2 halfAxes_m{};
  Vector2 halfAxesDeviation_m{};
  double orientation_rad = 0.0;           ///< of the larger one, from x towards y, in [-pi/2, pi/2)
  double orientationDeviation_rad = 0.0;  ///< at most pi / sqrt(12), where any orientation is possible
  /// Of a round contact: mean squared distance of its shear from its centre over that of its pressure.
  double shearSpreadRatio = 0.0;
  double shearSpreadRatioDeviation = 0.0;  ///< 0: not known
  double hertzRadius_m = 0.0;  ///< of Hertz's pressure, of a contact that is described as one round patch; else 0
  double hertzRadiusDeviation_m = 0.0;
};

/// Motion of the whole picture since the zero, caused by vibration or heat. Scale and roll are about the principal
/// point.
struct PictureMotion {
  Vector2 shift_px{};     ///< along (u, v)
  double scale = 0.0;     ///< relative change of size
  double roll_rad = 0.0;  ///< from u towards v
};

/// States which of the bounds on a frame's capture time hold.
enum class CaptureBound : std::uint8_t {
  kNone,  ///< none
  kBoth,  ///< captured_ns - capturedError_ns is a lower bound and captured_ns + capturedError_ns an upper bound
  /// Only the upper bound holds. The true time is earlier by the shortest delay from camera to host, which is not
  /// known.
  kLatest,
};

/// Metadata of every message. For Field, Markers, Contacts and Preview it describes their own frame; for Description
/// and Status the frame published last.
struct Header {
  /// Number of the message on its topic, from 1 at the daemon's start; a gap counts lost messages.
  std::uint64_t sequence = 0;
  std::string sensor;       ///< name in the daemon's configuration
  Id boot{};                ///< new at each start of the daemon; sequence and frameNumber restart with it
  Id calibration{};         ///< identifies what the forces are computed from; equals Description::calibration.id
  Id zero{};                ///< identifies the zero that displacements are measured from
  std::uint32_t flags = 0;  ///< bitwise or of Flag

  std::uint64_t cameraFrameId = 0;           ///< the camera's own count; 16 bit on GigE Vision 1.x
  std::uint64_t frameNumber = 0;             ///< increases; jumps where frames of the camera were lost
  std::int64_t deviceTime_ns = 0;            ///< the camera's clock, whose epoch the camera defines
  double exposure_s = 0.0;                   ///< as sent with the frame, else as configured; 0: not reported
  std::optional<double> gain;                ///< as sent with the frame, in the camera's unit
  std::optional<std::uint64_t> lineStatus;   ///< as sent with the frame: levels of the camera's lines, line 0 in bit 0
  std::optional<float> cameraTemperature_C;  ///< as the camera said last
  /// When the frame came from the camera driver: CLOCK_REALTIME of the daemon's host [ns since 1970].
  std::int64_t receivedReal_ns = 0;

  // The following times are CLOCK_MONOTONIC of the daemon's host.
  /// Camera's time stamp, mapped to the host's clock; without a camera clock, the time of arrival. 0: not known.
  std::int64_t captured_ns = 0;
  std::int64_t capturedError_ns = 0;                 ///< half width of the uncertainty of that mapping
  CaptureBound capturedBound = CaptureBound::kNone;  ///< which bounds hold
  std::int64_t received_ns = 0;                      ///< when the frame came from the camera driver
  std::int64_t tracked_ns = 0;                       ///< when its markers were located
  std::int64_t solved_ns = 0;                        ///< when its forces were computed
  std::int64_t sent_ns = 0;                          ///< when this message was handed to ZeroMQ

  /// When receive() took the message: CLOCK_MONOTONIC of this host; 0 in answers of Control. Where
  /// Description::sameHost is true, arrived_ns - received_ns is the latency.
  std::int64_t arrived_ns = 0;
};

/// The forces of one frame.
struct Field {
  Header header;
  bool valid = false;  ///< false: too few markers, no solution in time, a contradicted gel file or a numeric failure;
                       ///< all below is 0
  std::vector<std::array<float, 3>> force_N;  ///< per node of Description::nodes, gel frame
  std::vector<std::uint8_t> nodeValid;        ///< per node; 0: not valid, its force is 0
  Vector3 resultant_N{};                      ///< sum of the forces, gel frame
  Vector3 moment_Nm{};                        ///< about the origin of the gel frame
  Vector2 centreOfPressure_m{};               ///< of the normal forces, on the touched surface
  bool centreOfPressureValid = false;         ///< false: the normal force is too small
  Covariance resultantCovariance_N2;
  Covariance momentCovariance_N2m2;
  Covariance resultantMomentCovariance_N2m;           ///< row: component of the resultant; column: of the moment
  std::vector<std::array<float, 3>> nodeDeviation_N;  ///< standard deviation of each force that noise alone causes
  std::vector<Contact> contacts;                      ///< strongest first
  Method method = Method::kNone;
  Solution solution = Solution::kNone;
  std::uint64_t modelFrame = 0;          ///< of kLinear: Header::frameNumber of that frame; else 0
  double regularisation_px_per_N = 0.0;  ///< of earlier daemons: lambda of their penalty; now 0
  PictureMotion pictureMotion;
  /// Root mean square of what the forces do not explain, over the valid markers' coordinates.
  double residual_px = 0.0;
  std::uint32_t validMarkers = 0;  ///< number of markers that the forces were computed from
};

/// Shear of a node over its normal force, and the standard deviation that noise alone causes. Where a ball slips it is
/// the friction, where it sticks less. Returns none where the normal force is below three deviations, or those are not
/// stated.
struct ShearRatio {
  double ratio = 0.0, deviation = 0.0;
};
inline std::optional<ShearRatio> shearRatio(const Field& field, std::size_t node) {
  if (node >= field.force_N.size() || node >= field.nodeDeviation_N.size()) return std::nullopt;
  const auto& [x, y, normal] = field.force_N[node];
  const auto& [ofX, ofY, ofNormal] = field.nodeDeviation_N[node];
  if (!(normal > 3.0F * ofNormal)) return std::nullopt;
  const double shear = std::hypot(x, y), ratio = shear / normal;
  const double across = shear > 0.0 ? std::hypot(x * ofX, y * ofY) / shear : std::fmax(ofX, ofY);
  return ShearRatio{ratio, std::hypot(across, ratio * ofNormal) / normal};
}

/// The markers of one frame, in the order of Description::layers, layer after layer.
struct Markers {
  Header header;
  std::vector<std::array<float, 2>> displacement_px;  ///< (u, v) from the rest position in the picture
  std::vector<float> variance_px2;                    ///< variance of each of the two coordinates
  std::vector<std::uint8_t> valid;                    ///< per marker; 0: not found, its numbers are 0
  std::uint32_t validMarkers = 0;                     ///< number of markers that are valid
};

/// What became of a TrackedContact.
enum class ContactPhase : std::uint8_t {
  kNone,     ///< of a later version
  kBegin,    ///< seen for the first time
  kMove,     ///< seen again
  kAbsent,   ///< not in this field, and may come back: lifted, became one with another, or too faint
  kUnknown,  ///< this field is not valid
  kEnd,      ///< the last time that this id is reported
};

/// How a TrackedContact ended. Only kLifted says that nothing is there.
enum class EndCause : std::uint8_t {
  kNone,     ///< it has not ended; or of a later or an early version
  kLifted,   ///< fields that are valid went without it: lifted, or too faint
  kMerged,   ///< as kLifted, but when it went another contact gained its force: it is part of that
  kNotSeen,  ///< nothing is known of it: fields were not valid, or did not come, or messages were lost; it may last
  kZero,     ///< another zero or gel file holds: what still touches has begun anew
  kStopped,  ///< tractiond or traction-touch was stopped or started anew, or time went back; it may last
};

enum class SlipState : std::uint8_t {
  kUnknown,    ///< says nothing about slip: little of the friction is known
  kSticking,   ///< none of the others
  kIncipient,  ///< the alarm: more than 0.8 of the load is reached at which it slips, probably
  kSlipping,   ///< it moved along its load in the last 0.2 s, and may bear no more
};

/// What the friction of a contact is known by.
enum class SlipModel : std::uint8_t {
  kNone,     ///< of a later version, or of an early one, which had the ball alone
  kBall,     ///< how far its shear is spread, as under a ball
  kBound,    ///< what it bears: the least friction that bears its shear and torque; the state is kUnknown
  kSliding,  ///< what it bore while it slid or turned along its load
};

/// Median and 95 % interval.
struct Interval {
  double estimate = 0.0, low = 0.0, high = 0.0;
};

/// What a contact shows of friction. Its load is shear and torque together, as in contacts.proto.
struct Slip {
  SlipState state = SlipState::kUnknown;
  Interval stickRatio;  ///< radius of what sticks over that of the contact, of a ball under this load
  /// Coefficient of friction; a high end of 3: the contact shows a lower bound only. Of kBound the estimate is that.
  Interval friction;
  double margin_N = 0.0;        ///< further shear until it slips
  double holdingForce_N = 0.0;  ///< normal force that holds the load, by friction.low, with a quarter in reserve
  SlipModel model = SlipModel::kNone;
};

/// A contact that lasts. Position, radius, half axes and orientation are as last seen; force, moment, their covariances
/// and velocities are 0, and say nothing, in the phases absent, unknown and end. Deviations are standard deviations
/// that noise alone causes.
struct TrackedContact {
  std::uint64_t id = 0;  ///< from 1, increasing; not used again in a run
  ContactPhase phase = ContactPhase::kNone;
  bool doubted = false;       ///< errors may exceed the deviations: a flag of the field in which it was last seen
  std::int64_t begun_ns = 0;  ///< capture time, else arrival, of the frames in which it was seen first and last
  std::int64_t seen_ns = 0;
  Vector2 position_m{};  ///< centre of its normal forces, gel frame
  Vector2 positionDeviation_m{};
  double radius_m = 0.0;  ///< of a disc with Contact::area_m2
  double radiusDeviation_m = 0.0;
  Vector3 force_N{};  ///< shear (x, y) and normal force (z), gel frame
  Vector3 forceDeviation_N{};
  Vector2 velocity_m_s{};  ///< of its position
  Vector2 velocityDeviation_m_s{};
  std::optional<Slip> slip;  ///< none: not known, which does not mean that nothing slips
  // As of Contact.
  Vector3 moment_Nm{};  ///< about (position_m, positionZ_m); of a block, z is the torque about the normal
  double positionZ_m = 0.0;
  Covariance forceCovariance_N2{};
  Covariance momentCovariance_N2m2{};
  Covariance forceMomentCovariance_N2m{};
  Vector2 halfAxes_m{};
  Vector2 halfAxesDeviation_m{};
  double orientation_rad = 0.0;
  double orientationDeviation_rad = 0.0;

  double angularVelocity_rad_s = 0.0;           ///< of the larger half axis, from x towards y
  double angularVelocityDeviation_rad_s = 0.0;  ///< 5 where it is not measured, as of a round contact

  EndCause endCause = EndCause::kNone;  ///< in the phase end
};

enum class CriticalPointKind : std::uint8_t {
  kNone,    ///< of a later version
  kVortex,  ///< the shear turns about it more than it points away from it or towards it
  kSource,  ///< points away from it
  kSink,    ///< points towards it
  kSaddle,
};

/// Where the shear on the gel vanishes, and around which it turns.
struct CriticalPoint {
  /// From 1, increasing; not used again in a run. It lasts while no field is without the point for 0.1 s or three
  /// intervals.
  std::uint64_t id = 0;
  CriticalPointKind kind = CriticalPointKind::kNone;
  std::int32_t index = 0;     ///< Poincare's: -1 of a saddle, 1 of the others
  std::int64_t begun_ns = 0;  ///< of the frame in which it was seen first, as TrackedContact::begun_ns
  Vector2 position_m{};       ///< gel frame
  /// That noise of the nodes around causes if it is the same in all of them; places are off by a third more (rms).
  Vector2 positionDeviation_m{};
  double strength = 0.0;   ///< least change of the nodes' shear by which it vanishes, in their deviations
  double angle_rad = 0.0;  ///< 0: source, +-pi/2: vortex (+: from x towards y), pi: sink; of a saddle 0
};

/// The contacts of one frame, by traction-touch. Each that begins ends once: see Subscriber.
struct Contacts {
  /// As of the field that this was made of, but `sequence` counts these messages from the start of traction-touch, and
  /// `sent_ns` is of this message.
  Header header;
  Id run{};                                   ///< new at each start of traction-touch, with which ids begin again
  bool valid = false;                         ///< false: the field is not valid, or none came in time
  std::vector<TrackedContact> contacts;       ///< first those that end here
  std::vector<CriticalPoint> criticalPoints;  ///< that this field shows
};

/// Whether a finger's frame is in a Grasp.
enum class FingerState : std::uint8_t {
  kNone,       ///< of a later version
  kMatched,    ///< its frame is one of those that were captured together
  kNotValid,   ///< so it is, but its field is not valid
  kUnmatched,  ///< its frames come, but not at the time of the other fingers' frames
  kUndated,    ///< its frames come without a bound of their time of capture
  kMissing,    ///< no frame of it came in 0.1 s, or in three intervals of the slowest finger
  kAmbiguous,  ///< frames of two daemons came for it in the last second, or another finger has the same sensor
};

/// A finger of a Grasp, in whose frame and about whose origin its part of the wrench is.
struct Finger {
  std::string instance;  ///< of tractiond, from the hand file
  std::string link;      ///< name of its gel's frame in the robot's description (URDF), from the hand file
  FingerState state = FingerState::kNone;
  // As in the header of its Field; of the last one where it is not matched.
  std::string sensor;
  std::uint64_t frameNumber = 0;
  std::int64_t captured_ns = 0;
  std::int64_t capturedError_ns = 0;
  CaptureBound capturedBound = CaptureBound::kNone;
  // Its part of the grasp; 0 in every other state than kMatched.
  Vector3 force_N{};
  Vector3 moment_Nm{};
  Covariance forceCovariance_N2;
  Covariance momentCovariance_N2m2;
  Covariance forceMomentCovariance_N2m;  ///< row: component of the force; column: of the moment
};

/// What all fingers of a hand bear together, at one time, by traction-touch --hand. In the hand's frame, which is that
/// of the poses in the hand file; forces are those of the object on the hand, moments about the origin.
struct Grasp {
  /// `sensor` is the name of the hand, `boot` new at each start of traction-touch; `flags` are those of all fingers
  /// together. captured_ns +- capturedError_ns contains the times of capture of all fingers, with their errors.
  Header header;
  bool valid = false;   ///< false: a finger is not kMatched; the wrench is 0
  Vector3 force_N{};    ///< sum over the fingers of the whole field's resultant
  Vector3 moment_Nm{};  ///< about the origin of the hand's frame
  Covariance forceCovariance_N2;
  Covariance momentCovariance_N2m2;
  Covariance forceMomentCovariance_N2m;  ///< row: component of the force; column: of the moment
  std::vector<Finger> fingers;           ///< in the order of the hand file
};

/// A picture of the camera, reduced in size for display.
struct Preview {
  Header header;  ///< of the picture's frame; tracked_ns and solved_ns are 0
  std::uint32_t width = 0, height = 0;
  std::uint32_t channels = 3;        ///< bytes per pixel; 3: red, green, blue; 1: grey
  std::vector<std::uint8_t> pixels;  ///< height x width x channels, row by row, without padding
  /// Pixel (u, v) of this picture lies at origin_px + scale * (u, v) in the camera's picture.
  double scale = 1.0;  ///< camera pixels per pixel of this picture, in each direction
  Vector2 origin_px{};
};

}  // namespace traction
