// Messages are never cleared but overwritten: Protobuf keeps the memory of strings, arrays and sub-messages that way.

#include "daemon/publish/wire.h"

#include "daemon/publish/wire_parts.h"
#include "proto/traction/v1/vectors.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/field.pb.h"
#include "traction/v1/markers.pb.h"
#include "traction/v1/preview.pb.h"
#include "traction/v1/status.pb.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace tractiond::publish {

namespace pb = traction::v1;
using traction::setVector;

namespace {

static_assert(static_cast<int>(pb::FLAG_ZERO_UNVERIFIED) == kZeroUnverified);
static_assert(static_cast<int>(pb::FLAG_FEW_MARKERS) == kFewMarkers);
static_assert(static_cast<int>(pb::FLAG_DISCONTINUITY) == kDiscontinuity);
static_assert(static_cast<int>(pb::FLAG_REACQUIRING) == kReacquiring);
static_assert(static_cast<int>(pb::FLAG_TORN) == kTorn);
static_assert(static_cast<int>(pb::FLAG_UNEXPLAINED) == kUnexplained);
static_assert(static_cast<int>(pb::FLAG_OUT_OF_RANGE) == kOutOfRange);
static_assert(static_cast<int>(pb::FLAG_GEL_MISMATCH) == kGelMismatch);
static_assert(static_cast<int>(pb::FLAG_DOUBTED_ORIGIN) == kDoubtedOrigin);
static_assert(static_cast<int>(pb::FLAG_NOT_SOLVED) == kNotSolved);
static_assert(static_cast<int>(pb::FLAG_RECOVERING) == kRecovering);
static_assert(static_cast<int>(pb::FLAG_GEL_UNVERIFIED) == kGelUnverified);
static_assert(static_cast<int>(pb::METHOD_CONTACT) == static_cast<int>(Method::kContact));
static_assert(static_cast<int>(pb::Solution_MAX) == static_cast<int>(Solution::kLinear));
static_assert(static_cast<int>(pb::CaptureBound_MAX) == static_cast<int>(CaptureBound::kLatest));
static_assert(pb::Colour_MAX - pb::COLOUR_BLUE == static_cast<int>(sensor::Colour::kGrey));

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

void set(const Id& from, std::string& to) {
  if (from == Id{}) {
    to.clear();
  } else {
    to.assign(reinterpret_cast<const char*>(from.data()), from.size());
  }
}

void set(const std::vector<std::uint8_t>& from, std::string& to) {
  to.assign(reinterpret_cast<const char*>(from.data()), from.size());
}

/// A vector's or a matrix's numbers as they are in memory.
void set(const auto& from, google::protobuf::RepeatedField<float>& to) {
  to.Resize(static_cast<int>(from.size()), 0.0F);
  std::transform(from.data(), from.data() + from.size(), to.begin(),
                 [](auto number) { return static_cast<float>(number); });
}

void set(const sensor::MarkerLayer& from, pb::MarkerLayer& to) {
  to.set_colour(wireColour(from.colour));
  to.set_darker(from.darker);
  to.set_columns(static_cast<std::uint32_t>(from.columns));
  to.set_rows(static_cast<std::uint32_t>(from.rows));
  to.set_pitch_m(from.pitch);
  to.set_depth_m(from.depth);
  setVector(from.centre, *to.mutable_centre_m());
  to.set_diameter_m(from.diameter);
}

void set(const sensor::Camera& from, pb::Camera& to) {
  to.set_width_px(static_cast<std::uint32_t>(from.width));
  to.set_height_px(static_cast<std::uint32_t>(from.height));
  to.set_focal_px(from.focal_px);
  to.set_aspect(from.aspect);
  setVector(from.principal_px, *to.mutable_principal_px());
  to.set_k1(from.k1);
  to.set_k2(from.k2);
  to.set_fisheye(from.fisheye);
  to.set_k3(from.k3);
  to.set_k4(from.k4);
  setVector(from.position, *to.mutable_position_m());
  setVector(from.rotation, *to.mutable_rotation_rad());
  to.set_gel_index(from.gelIndex);
  to.set_window_index(from.windowIndex);
  to.set_window_thickness_m(from.windowThickness);
  for (const sensor::RefractingSurface& surface : from.surfaces) {
    pb::RefractingSurface& added = *to.add_surfaces();
    setVector(surface.centre, *added.mutable_centre_m());
    setVector(surface.radii, *added.mutable_radii_m());
    added.set_index(surface.index);
  }
}

void set(const sensor::Body& from, pb::Body& to) {
  set(from.nodes, *to.mutable_node_positions_m());
  set(from.normals, *to.mutable_node_normals());
  set(from.areas, *to.mutable_node_areas_m2());
  set(from.markers, *to.mutable_marker_positions_m());
}

/// The block of a wrench's covariances that begins at (row, column).
/// \param of a field or a contact
void set(const auto& of, int row, int column, pb::Covariance& to) {
  to.clear_noise();
  to.clear_systematic();
  for (int i = row; i < row + 3; ++i) {
    for (int j = column; j < column + 3; ++j) {
      to.add_noise(of.noise[6 * i + j]);
      to.add_systematic(of.systematic[6 * i + j]);
    }
  }
}

void set(const Contact& from, pb::Contact& to) {
  setVector(from.position_m, *to.mutable_position_m());
  setVector(from.positionDeviation_m, *to.mutable_position_deviation_m());
  setVector(from.force_N, *to.mutable_force_n());
  setVector(from.forceDeviation_N, *to.mutable_force_deviation_n());
  to.set_area_m2(from.area_m2);
  to.set_area_deviation_m2(from.areaDeviation_m2);
  setVector(from.moment_Nm, *to.mutable_moment_nm());
  to.set_position_z_m(from.positionZ_m);
  set(from, 0, 0, *to.mutable_force_covariance_n2());
  set(from, 3, 3, *to.mutable_moment_covariance_n2m2());
  set(from, 0, 3, *to.mutable_force_moment_covariance_n2m());
  setVector(from.halfAxes_m, *to.mutable_half_axes_m());
  setVector(from.halfAxesDeviation_m, *to.mutable_half_axes_deviation_m());
  to.set_orientation_rad(from.orientation_rad);
  to.set_orientation_deviation_rad(from.orientationDeviation_rad);
  to.set_shear_spread_ratio(from.spreadRatio);
  to.set_shear_spread_ratio_deviation(from.spreadRatioDeviation);
  to.set_hertz_radius_m(from.hertzRadius_m);
  to.set_hertz_radius_deviation_m(from.hertzRadiusDeviation_m);
}

}  // namespace

void encode(const Identity& identity, pb::Header& header) {
  header.set_sensor(identity.sensor);
  set(identity.boot, *header.mutable_boot());
  set(identity.calibration, *header.mutable_calibration());
}

void encode(const Heading& heading, pb::Header& header) {
  header.set_sequence(heading.sequence);
  set(heading.zero, *header.mutable_zero());
  header.set_flags(heading.flags);
  const FrameInfo& frame = heading.frame;
  header.set_camera_frame_id(frame.cameraFrameId);
  header.set_frame_number(frame.frameNumber);
  header.set_device_time_ns(frame.times.device_ns);
  header.set_exposure_s(frame.exposure_s);
  header.clear_gain();
  header.clear_line_status();
  header.clear_camera_temperature();
  if (frame.extras.hasGain) header.set_gain(frame.extras.gain);
  if (frame.extras.hasLines) header.set_line_status(frame.extras.lines);
  if (frame.extras.hasTemperature) header.set_camera_temperature(frame.extras.temperature_C);
  header.set_received_real_ns(frame.times.receivedReal_ns);
  header.set_received_ns(frame.times.received_ns);
  header.set_captured_ns(frame.times.captured_ns);
  header.set_captured_error_ns(frame.times.capturedError_ns);
  header.set_captured_bound(static_cast<pb::CaptureBound>(frame.times.capturedBound));
  header.set_tracked_ns(frame.times.tracked_ns);
  header.set_solved_ns(frame.times.solved_ns);
  header.set_sent_ns(heading.sent_ns);
}

void encode(const RestPose& from, pb::Zero& to) {
  set(from.id, *to.mutable_id());
  to.set_time_ns(from.taken_ns);
  to.set_requested(from.requested);
  set(from.position_px, *to.mutable_rest_position_px());
  set(from.present, *to.mutable_marker_present());
  to.set_requested_by(from.requestedBy);
}

void encode(const std::array<double, 2>& detectionLimit_N, pb::Solver& to) {
  to.set_detection_limit_tangential_n(detectionLimit_N[0]);
  to.set_detection_limit_normal_n(detectionLimit_N[1]);
}

pb::Colour wireColour(sensor::Colour colour) {
  return static_cast<pb::Colour>(static_cast<int>(colour) + pb::COLOUR_BLUE);
}

void describe(const sensor::Sensor& sensor, pb::Description& message) {
  message.mutable_gel()->set_youngs_modulus_pa(sensor.gel.youngsModulus);
  message.mutable_gel()->set_poisson_ratio(sensor.gel.poissonRatio);
  setVector(sensor.gel.size, *message.mutable_gel()->mutable_size_m());
  for (const sensor::MarkerLayer& layer : sensor.layers) set(layer, *message.add_layers());
  message.mutable_nodes()->set_columns(static_cast<std::uint32_t>(sensor.nodes.columns));
  message.mutable_nodes()->set_rows(static_cast<std::uint32_t>(sensor.nodes.rows));
  message.mutable_nodes()->set_pitch_m(sensor.nodes.pitch);
  setVector(sensor.nodes.centre, *message.mutable_nodes()->mutable_centre_m());
  set(sensor.camera, *message.mutable_camera());
  if (sensor.body) set(*sensor.body, *message.mutable_body());
}

void encode(const Heading& heading, pb::Description& message) {
  message.set_timestamp(seconds(heading.sentReal_ns));
  encode(heading, *message.mutable_header());
  message.mutable_header()->set_zero(message.zero().id());
}

struct Wire::Messages {
  /// Makes room for as many contacts in `field`. Clears none, as that frees the messages in it.
  void resizeContacts(int count) {
    auto& contacts = *field.mutable_contacts();
    while (contacts.size() > count) spare.emplace_back(contacts.ReleaseLast());
    while (contacts.size() < count) {
      contacts.AddAllocated(spare.back().release());
      spare.pop_back();
    }
  }

  pb::Field field;
  std::vector<std::unique_ptr<pb::Contact>> spare;  ///< contacts that are not in `field`
  pb::Markers markers;
  pb::Preview preview;
  pb::Status status;
};

Wire::Wire(const Identity& identity)
    : messages_(std::make_unique<Messages>()) {
  encode(identity, *messages_->field.mutable_header());
  for (int i = 0; i < kMaxContacts; ++i) set(Contact{}, *messages_->field.add_contacts());
  messages_->spare.reserve(kMaxContacts);
  encode(identity, *messages_->markers.mutable_header());
  encode(identity, *messages_->preview.mutable_header());
  encode(identity, *messages_->status.mutable_header());
}

Wire::~Wire() = default;

const google::protobuf::MessageLite& Wire::fill(const TractionField& field, const Heading& heading) {
  pb::Field& message = messages_->field;
  message.set_timestamp(seconds(heading.frame.times.receivedReal_ns));
  encode(heading, *message.mutable_header());
  message.set_valid(field.valid);
  set(field.force_N, *message.mutable_force_n());
  message.mutable_node_valid()->assign(field.force_N.size() / 3, field.valid ? '\1' : '\0');
  setVector(field.resultant_N, *message.mutable_resultant_n());
  setVector(field.moment_Nm, *message.mutable_moment_nm());
  setVector(field.centreOfPressure_m, *message.mutable_centre_of_pressure_m());
  message.set_centre_of_pressure_valid(field.centreOfPressureValid);
  message.set_residual_px(field.residual_px);
  message.set_valid_markers(static_cast<std::uint32_t>(field.markers.validCount));
  set(field, 0, 0, *message.mutable_resultant_covariance_n2());
  set(field, 3, 3, *message.mutable_moment_covariance_n2m2());
  set(field, 0, 3, *message.mutable_resultant_moment_covariance_n2m());
  set(field.deviation_N, *message.mutable_node_deviation_n());
  messages_->resizeContacts(field.contactCount);
  for (int i = 0; i < field.contactCount; ++i) set(field.contacts[i], *message.mutable_contacts(i));
  message.set_method(static_cast<pb::Method>(field.method));
  message.set_solution(static_cast<pb::Solution>(field.solution));
  message.set_model_frame(field.modelFrame);
  pb::PictureMotion& motion = *message.mutable_picture_motion();
  setVector(field.pictureMotion, *motion.mutable_shift_px());
  motion.set_scale(field.pictureMotion[2]);
  motion.set_roll_rad(field.pictureMotion[3]);
  return message;
}

const google::protobuf::MessageLite& Wire::fill(const MarkerField& markers, const Heading& heading) {
  pb::Markers& message = messages_->markers;
  message.set_timestamp(seconds(heading.frame.times.receivedReal_ns));
  encode(heading, *message.mutable_header());
  set(markers.displacement_px, *message.mutable_displacement_px());
  set(markers.variance_px2, *message.mutable_variance_px2());
  set(markers.valid, *message.mutable_marker_valid());
  message.set_valid_markers(static_cast<std::uint32_t>(markers.validCount));
  return message;
}

const google::protobuf::MessageLite& Wire::fill(const Preview& preview, const Heading& heading) {
  pb::Preview& message = messages_->preview;
  Heading ofFrame = heading;
  ofFrame.frame = preview.info;
  ofFrame.frame.times.tracked_ns = ofFrame.frame.times.solved_ns = 0;
  ofFrame.flags = preview.flags;
  ofFrame.zero = preview.zero;
  message.set_timestamp(seconds(preview.info.times.receivedReal_ns));
  encode(ofFrame, *message.mutable_header());
  const PlainPicture& picture = preview.picture;
  message.set_width(static_cast<std::uint32_t>(picture.width));
  message.set_height(static_cast<std::uint32_t>(picture.height));
  message.set_format(picture.channels == 1 ? pb::PREVIEW_FORMAT_MONO8 : pb::PREVIEW_FORMAT_RGB8);
  set(picture.levels, *message.mutable_pixels());
  message.set_scale(preview.factor);
  const double origin_px = 0.5 * (preview.factor - 1);
  setVector(std::array{origin_px, origin_px}, *message.mutable_origin_px());
  return message;
}

pb::Status& Wire::status() {
  return messages_->status;
}

const google::protobuf::MessageLite& Wire::fillStatus(const Ledger& ledger, const Heading& heading) {
  pb::Status& message = messages_->status;
  message.set_timestamp(seconds(heading.sentReal_ns));
  encode(heading, *message.mutable_header());

  pb::Ledger& account = *message.mutable_ledger();
  const std::uint64_t ended = ledger.copyTo(account);
  // Reads `received` last, so that frames which move on meanwhile do not make the rest negative.
  account.set_received(std::max(ledger.received.get(), ended));
  account.set_in_flight(account.received() - ended);
  return message;
}

}  // namespace tractiond::publish
