// What tractiond publishes of each frame.
//
// Gel frame: the origin lies on the touched surface at the centre of the marker field; x points to the right and y up
// in the camera's picture, z into the gel, towards the camera. A force is the force of the object on the gel: pressing
// is +z. Pixels: u to the right, v down. SI units. No number is ever NaN: what is not valid is marked so and is 0.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace traction {

using Id = std::array<std::uint8_t, 16>;  ///< a hash or random; all zero: none
using Vector2 = std::array<double, 2>;    ///< x, y
using Vector3 = std::array<double, 3>;    ///< x, y, z

/// Bits of Header::flags: reasons to be careful.
enum Flag : std::uint32_t {
  kZeroUnverified = 1,   ///< nobody has confirmed, and no unloaded picture has shown, that the zero is a zero
  kFewMarkers = 2,       ///< too few markers are seen: the field is not valid
  kDiscontinuity = 4,    ///< frames were lost or the clocks jumped before this frame
  kReacquiring = 8,      ///< markers were labelled anew in this frame
  kTorn = 16,            ///< the picture does not hang together: rows of another moment, or moved aside
  kUnexplained = 32,     ///< the picture shows displacements that no forces on the surface can make
  kOutOfRange = 64,      ///< the forces are beyond the range for which the uncertainty is known
  kGelMismatch = 128,    ///< the rest picture contradicts the gel file: the field is not valid
  kDoubtedOrigin = 256,  ///< packets came twice, early, or beside the camera's own: the picture may be somebody else's
};

/// 3 x 3, row after row: x, y, z by x, y, z.
using Matrix3 = std::array<double, 9>;

/// The whole is the sum of the two.
struct Covariance {
  Matrix3 noise{};       ///< what differs from frame to frame
  Matrix3 systematic{};  ///< what does not: the sensor's numbers, and what may lie beyond its nodes
};

/// How the forces of a field were found.
enum class Method : std::uint8_t {
  kNone,       ///< not valid, or not told
  kNoContact,  ///< nothing above the detection limit (Description::solver): all forces are 0
  kContact,    ///< for the nodes alone that carry something
  kWholeFace,  ///< for all nodes, because the contact is large or does not explain the picture
  kBlend,      ///< a mean of the two, on the way from one to the other
};

/// Where something touches. Deviations are standard deviations, of the noise alone.
struct Contact {
  Vector2 position_m{};  ///< of its normal forces (of all its forces where it does not press), gel frame
  Vector2 positionDeviation_m{};
  Vector3 force_N{};  ///< gel frame
  Vector3 forceDeviation_N{};
  double area_m2 = 0.0;  ///< of an even pressure that would be as concentrated
  double areaDeviation_m2 = 0.0;
};

/// Of the whole picture since the zero, by vibration or heat; scale and roll about the principal point.
struct PictureMotion {
  Vector2 shift_px{};     ///< u, v
  double scale = 0.0;     ///< relative
  double roll_rad = 0.0;  ///< from u towards v
};

/// What is known of when a frame was captured.
enum class CaptureBound : std::uint8_t {
  kNone,    ///< nothing
  kBoth,    ///< not earlier than captured_ns - capturedError_ns, nor later than captured_ns + capturedError_ns
  kLatest,  ///< only the latter; it was earlier by the shortest delay from camera to host, which nobody has measured
};

/// Stands at the head of every message. Of a Field or Markers: their frame; of a Description or Status: the last one.
struct Header {
  std::uint64_t sequence = 0;  ///< of this topic since the start of the daemon, from 1; a gap: lost on the way
  std::string sensor;          ///< name from the daemon's config
  Id boot{};                   ///< of this start of the daemon: sequence and frameNumber start again with it
  Id calibration{};            ///< of what the forces rest on; Description::calibration
  Id zero{};                   ///< of the rest pose that displacements are counted from
  std::uint32_t flags = 0;     ///< or-ed Flag

  std::uint64_t cameraFrameId = 0;          ///< as the camera counts; 16 bit on GigE Vision 1.x
  std::uint64_t frameNumber = 0;            ///< counted up; jumps where frames of the camera were lost
  std::int64_t deviceTime_ns = 0;           ///< the camera's own clock
  double exposure_s = 0.0;                  ///< as sent with the frame, else as set; 0: the camera does not tell
  std::optional<double> gain;               ///< as sent with the frame, in the camera's own unit
  std::optional<std::uint64_t> lineStatus;  ///< as sent with the frame: levels of the camera's lines, line 0 lowest
  std::int64_t receivedReal_ns = 0;  ///< CLOCK_REALTIME of the daemon's host when the frame came from the camera driver

  // CLOCK_MONOTONIC of the daemon's host.
  std::int64_t captured_ns = 0;       ///< when the camera stamped it, by the running mapping of its clock; 0: not known
  std::int64_t capturedError_ns = 0;  ///< half width of that mapping
  CaptureBound capturedBound = CaptureBound::kNone;  ///< which sides of it hold
  std::int64_t received_ns = 0;                      ///< when the frame came from the camera driver
  std::int64_t tracked_ns = 0;                       ///< when its markers were found
  std::int64_t solved_ns = 0;                        ///< when its forces were known
  std::int64_t sent_ns = 0;                          ///< when this message was handed to be sent

  /// CLOCK_MONOTONIC of this host when receive() took the message; 0 in answers of Control. Less received_ns it is the
  /// latency where Description::sameHost holds.
  std::int64_t arrived_ns = 0;
};

/// The forces of one frame.
struct Field {
  Header header;
  bool valid = false;                         ///< false: too few markers or a numeric failure; all below is 0
  std::vector<std::array<float, 3>> force_N;  ///< on each node of Description::nodes, gel frame [N]
  std::vector<std::uint8_t> nodeValid;        ///< one a node; 0: not valid, its force is 0
  Vector3 resultant_N{};                      ///< sum of the forces, gel frame [N]
  Vector3 moment_Nm{};                        ///< about the origin of the gel frame [N m]
  Vector2 centreOfPressure_m{};               ///< of the normal forces, on the touched surface [m]
  bool centreOfPressureValid = false;         ///< false: the normal force is too small for a centre
  Covariance resultantCovariance_N2;
  Covariance momentCovariance_N2m2;
  Covariance resultantMomentCovariance_N2m;           ///< row: component of the resultant
  std::vector<std::array<float, 3>> nodeDeviation_N;  ///< standard deviation of each force, of the noise alone [N]
  std::vector<Contact> contacts;                      ///< strongest first; none where the method is kWholeFace
  Method method = Method::kNone;
  double regularisation_px_per_N = 0.0;  ///< lambda of the penalty that was used [px/N]
  PictureMotion pictureMotion;
  double residual_px = 0.0;        ///< what the forces leave unexplained, root mean square [px]
  std::uint32_t validMarkers = 0;  ///< markers that the forces were solved from
};

/// Where the markers of one frame are. In the order of Description::layers, layer after layer.
struct Markers {
  Header header;
  std::vector<std::array<float, 2>> displacement_px;  ///< from the rest position in the picture, (u, v) [px]
  std::vector<float> variance_px2;                    ///< of each of the two coordinates [px^2]
  std::vector<std::uint8_t> valid;                    ///< one a marker; 0: not seen, its numbers are 0
  std::uint32_t validMarkers = 0;                     ///< how many are valid
};

/// The newest picture of the camera, reduced, for eyes.
struct Preview {
  Header header;  ///< of the picture's frame; tracked_ns and solved_ns are 0
  std::uint32_t width = 0, height = 0;
  std::uint32_t channels = 3;        ///< bytes a pixel; 3: red, green, blue; 1: grey
  std::vector<std::uint8_t> pixels;  ///< row after row, without gaps
  /// The pixel (u, v) of this picture lies in the camera's at origin_px + scale * (u, v).
  double scale = 1.0;  ///< pixels of the camera to one of this picture, in each direction
  Vector2 origin_px{};
};

}  // namespace traction
