#include "client/src/decode.h"

#include "client/src/messages.h"
#include "traction/v1/contacts.pb.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/field.pb.h"
#include "traction/v1/grasp.pb.h"
#include "traction/v1/markers.pb.h"
#include "traction/v1/preview.pb.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <type_traits>
#include <utility>

namespace traction {

namespace {

static_assert(static_cast<int>(kZeroUnverified) == pb::FLAG_ZERO_UNVERIFIED);
static_assert(static_cast<int>(kFewMarkers) == pb::FLAG_FEW_MARKERS);
static_assert(static_cast<int>(kDiscontinuity) == pb::FLAG_DISCONTINUITY);
static_assert(static_cast<int>(kReacquiring) == pb::FLAG_REACQUIRING);
static_assert(static_cast<int>(kTorn) == pb::FLAG_TORN);
static_assert(static_cast<int>(kDoubtedOrigin) == pb::FLAG_DOUBTED_ORIGIN);
static_assert(static_cast<int>(kNotSolved) == pb::FLAG_NOT_SOLVED);
static_assert(static_cast<int>(kRecovering) == pb::FLAG_RECOVERING);
static_assert(static_cast<int>(Method::kBlend) == pb::Method_MAX);
static_assert(static_cast<int>(Solution::kLinear) == pb::Solution_MAX);
static_assert(static_cast<int>(ContactPhase::kEnd) == pb::ContactPhase_MAX);
static_assert(static_cast<int>(SlipState::kSlipping) == pb::SlipState_MAX);
static_assert(static_cast<int>(SlipModel::kSliding) == pb::SlipModel_MAX);
static_assert(static_cast<int>(CriticalPointKind::kSaddle) == pb::CriticalPointKind_MAX);
static_assert(static_cast<int>(CaptureBound::kLatest) == pb::CaptureBound_MAX);
static_assert(static_cast<int>(Colour::kGrey) == pb::Colour_MAX);
static_assert(static_cast<int>(FingerState::kAmbiguous) == pb::FingerState_MAX);

Id idOf(const std::string& bytes) {
  Id id{};
  require(bytes.empty() || bytes.size() == id.size(), "an id has not 16 bytes");
  std::copy(bytes.begin(), bytes.end(), id.begin());
  return id;
}

std::vector<std::uint8_t> maskOf(const std::string& bytes) {
  return {bytes.begin(), bytes.end()};
}

/// Returns whether a number, or each number in nested ranges, is finite.
template <typename Numbers>
bool isFinite(const Numbers& numbers) {
  if constexpr (std::is_floating_point_v<Numbers>) {
    return std::isfinite(numbers);
  } else {
    return std::all_of(numbers.begin(), numbers.end(), [](const auto& each) { return isFinite(each); });
  }
}

/// Throws kMalformed unless all numbers are finite, because machines are controlled by them.
template <typename... Numbers>
void requireFinite(const Numbers&... numbers) {
  require((isFinite(numbers) && ...), "a number is not finite");
}

template <typename... Covariances>
void requireFiniteCovariances(const Covariances&... covariances) {
  (requireFinite(covariances.noise, covariances.systematic), ...);
}

/// Splits x y z x y z ... into vectors of kSize.
template <std::size_t kSize>
std::vector<std::array<float, kSize>> vectorsOf(const google::protobuf::RepeatedField<float>& numbers) {
  require(numbers.size() % kSize == 0, "a vector is incomplete");
  std::vector<std::array<float, kSize>> vectors(static_cast<std::size_t>(numbers.size()) / kSize);
  if (!vectors.empty()) std::memcpy(vectors.data(), numbers.data(), vectors.size() * sizeof vectors[0]);
  return vectors;
}

Vector2 vectorOf(const pb::Vector2& vector) {
  return {vector.x(), vector.y()};
}

Vector3 vectorOf(const pb::Vector3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

Header headerOf(const pb::Header& from) {
  Header header;
  header.sequence = from.sequence();
  header.sensor = from.sensor();
  header.boot = idOf(from.boot());
  header.calibration = idOf(from.calibration());
  header.zero = idOf(from.zero());
  header.flags = from.flags();
  header.cameraFrameId = from.camera_frame_id();
  header.frameNumber = from.frame_number();
  header.deviceTime_ns = from.device_time_ns();
  header.exposure_s = from.exposure_s();
  if (from.has_gain()) header.gain = from.gain();
  if (from.has_line_status()) header.lineStatus = from.line_status();
  if (from.has_camera_temperature()) header.cameraTemperature_C = from.camera_temperature();
  header.receivedReal_ns = from.received_real_ns();
  header.received_ns = from.received_ns();
  header.captured_ns = from.captured_ns();
  header.capturedError_ns = from.captured_error_ns();
  header.capturedBound = enumOf(from.captured_bound(), CaptureBound::kLatest);
  header.tracked_ns = from.tracked_ns();
  header.solved_ns = from.solved_ns();
  header.sent_ns = from.sent_ns();
  return header;
}

Body bodyOf(const pb::Body& from) {
  Body body;
  body.nodePositions_m = vectorsOf<3>(from.node_positions_m());
  body.nodeNormals = vectorsOf<3>(from.node_normals());
  body.nodeAreas_m2.assign(from.node_areas_m2().begin(), from.node_areas_m2().end());
  body.markerPositions_m = vectorsOf<3>(from.marker_positions_m());
  const std::size_t nodes = body.nodePositions_m.size();
  require(body.nodeNormals.size() == nodes && body.nodeAreas_m2.size() == nodes, "the body's nodes have other sizes");
  return body;
}

bool isThisHost(const std::string& host) {
  std::string text;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), text);
  text.erase(std::remove(text.begin(), text.end(), '-'), text.end());
  std::string told;
  for (const unsigned char byte : host) {
    told += "0123456789abcdef"[byte >> 4];
    told += "0123456789abcdef"[byte & 15];
  }
  return !text.empty() && text == told;
}

Camera cameraOf(const pb::Camera& from) {
  Camera camera;
  camera.vendor = from.vendor();
  camera.model = from.model();
  camera.serial = from.serial();
  camera.pixelFormat = from.pixel_format();
  camera.width_px = from.width_px();
  camera.height_px = from.height_px();
  camera.focal_px = from.focal_px();
  if (from.aspect() != 0.0) camera.aspect = from.aspect();  // older daemons support square pixels only
  camera.principal_px = vectorOf(from.principal_px());
  camera.k1 = from.k1();
  camera.k2 = from.k2();
  camera.position_m = vectorOf(from.position_m());
  camera.rotation_rad = vectorOf(from.rotation_rad());
  camera.gelIndex = from.gel_index();
  camera.windowIndex = from.window_index();
  camera.windowThickness_m = from.window_thickness_m();
  for (const pb::RefractingSurface& surface : from.surfaces()) {
    camera.surfaces.push_back({vectorOf(surface.centre_m()), vectorOf(surface.radii_m()), surface.index()});
  }
  return camera;
}

/// Returns zero if the daemon does not report the matrix.
Matrix3 matrixOf(const google::protobuf::RepeatedField<double>& from) {
  Matrix3 matrix{};
  require(from.empty() || from.size() == static_cast<int>(matrix.size()), "a covariance is not 3 x 3");
  std::copy(from.begin(), from.end(), matrix.begin());
  return matrix;
}

Covariance covarianceOf(const pb::Covariance& from) {
  return {matrixOf(from.noise()), matrixOf(from.systematic())};
}

/// Takes force, moment and their covariances. \throws Error as requireFinite()
void takeWrench(const auto& from, auto& to) {
  to.force_N = vectorOf(from.force_n());
  to.moment_Nm = vectorOf(from.moment_nm());
  to.forceCovariance_N2 = covarianceOf(from.force_covariance_n2());
  to.momentCovariance_N2m2 = covarianceOf(from.moment_covariance_n2m2());
  to.forceMomentCovariance_N2m = covarianceOf(from.force_moment_covariance_n2m());
  requireFinite(to.force_N, to.moment_Nm);
  requireFiniteCovariances(to.forceCovariance_N2, to.momentCovariance_N2m2, to.forceMomentCovariance_N2m);
}

/// Takes what a Contact and a TrackedContact have alike. \throws Error as requireFinite()
void takeWrenchAndEllipse(const auto& from, auto& to) {
  to.position_m = vectorOf(from.position_m());
  to.positionDeviation_m = vectorOf(from.position_deviation_m());
  takeWrench(from, to);
  to.forceDeviation_N = vectorOf(from.force_deviation_n());
  to.positionZ_m = from.position_z_m();
  to.halfAxes_m = vectorOf(from.half_axes_m());
  to.halfAxesDeviation_m = vectorOf(from.half_axes_deviation_m());
  to.orientation_rad = from.orientation_rad();
  to.orientationDeviation_rad = from.orientation_deviation_rad();
  requireFinite(to.position_m, to.positionDeviation_m, to.forceDeviation_N, to.positionZ_m, to.halfAxes_m,
                to.halfAxesDeviation_m, to.orientation_rad, to.orientationDeviation_rad);
}

Contact contactOf(const pb::Contact& from) {
  Contact contact;
  takeWrenchAndEllipse(from, contact);
  contact.area_m2 = from.area_m2();
  contact.areaDeviation_m2 = from.area_deviation_m2();
  contact.shearSpreadRatio = from.shear_spread_ratio();
  contact.shearSpreadRatioDeviation = from.shear_spread_ratio_deviation();
  contact.hertzRadius_m = from.hertz_radius_m();
  contact.hertzRadiusDeviation_m = from.hertz_radius_deviation_m();
  requireFinite(contact.area_m2, contact.areaDeviation_m2, contact.shearSpreadRatio, contact.shearSpreadRatioDeviation,
                contact.hertzRadius_m, contact.hertzRadiusDeviation_m);
  return contact;
}

Interval intervalOf(const pb::Interval& from) {
  requireFinite(from.estimate(), from.low(), from.high());
  return {from.estimate(), from.low(), from.high()};
}

Slip slipOf(const pb::Slip& from) {
  requireFinite(from.margin_n(), from.holding_force_n());
  return {enumOf(from.state(), SlipState::kSlipping),
          intervalOf(from.stick_ratio()),
          intervalOf(from.friction()),
          from.margin_n(),
          from.holding_force_n(),
          enumOf(from.model(), SlipModel::kSliding)};
}

TrackedContact contactOf(const pb::TrackedContact& from) {
  TrackedContact contact;
  takeWrenchAndEllipse(from, contact);
  contact.id = from.id();
  contact.phase = enumOf(from.phase(), ContactPhase::kEnd);
  contact.doubted = from.doubted();
  contact.begun_ns = from.begun_ns();
  contact.seen_ns = from.seen_ns();
  contact.radius_m = from.radius_m();
  contact.radiusDeviation_m = from.radius_deviation_m();
  contact.velocity_m_s = vectorOf(from.velocity_m_s());
  contact.velocityDeviation_m_s = vectorOf(from.velocity_deviation_m_s());
  if (from.has_slip()) contact.slip = slipOf(from.slip());
  contact.angularVelocity_rad_s = from.angular_velocity_rad_s();
  contact.angularVelocityDeviation_rad_s = from.angular_velocity_deviation_rad_s();
  requireFinite(contact.radius_m, contact.radiusDeviation_m, contact.velocity_m_s, contact.velocityDeviation_m_s,
                contact.angularVelocity_rad_s, contact.angularVelocityDeviation_rad_s);
  return contact;
}

CriticalPoint pointOf(const pb::CriticalPoint& from) {
  CriticalPoint point;
  point.id = from.id();
  point.kind = enumOf(from.kind(), CriticalPointKind::kSaddle);
  point.index = from.index();
  point.begun_ns = from.begun_ns();
  point.position_m = vectorOf(from.position_m());
  point.positionDeviation_m = vectorOf(from.position_deviation_m());
  point.strength = from.strength();
  point.angle_rad = from.angle_rad();
  requireFinite(point.position_m, point.positionDeviation_m, point.strength, point.angle_rad);
  return point;
}

Finger fingerOf(const pb::Finger& from) {
  Finger finger;
  takeWrench(from, finger);
  finger.instance = from.instance();
  finger.link = from.link();
  finger.state = enumOf(from.state(), FingerState::kAmbiguous);
  finger.sensor = from.sensor();
  finger.frameNumber = from.frame_number();
  finger.captured_ns = from.captured_ns();
  finger.capturedError_ns = from.captured_error_ns();
  finger.capturedBound = enumOf(from.captured_bound(), CaptureBound::kLatest);
  return finger;
}

}  // namespace

Zero zeroOf(const pb::Zero& from) {
  Zero zero;
  zero.id = idOf(from.id());
  zero.time_ns = from.time_ns();
  zero.requested = from.requested();
  zero.requestedBy = from.requested_by();
  zero.restPosition_px = vectorsOf<2>(from.rest_position_px());
  zero.markerPresent = maskOf(from.marker_present());
  require(zero.markerPresent.size() == zero.restPosition_px.size(), "the rest pose's mask has another size");
  return zero;
}

void requireFiniteGeometry(const Description& description) {
  const Gel& gel = description.gel;
  requireFinite(gel.youngsModulus_Pa, gel.poissonRatio, gel.size_m);
  for (const MarkerLayer& layer : description.layers) {
    requireFinite(layer.grid.pitch_m, layer.grid.centre_m, layer.depth_m, layer.diameter_m);
  }
  requireFinite(description.nodes.pitch_m, description.nodes.centre_m);
  const Camera& camera = description.camera;
  requireFinite(camera.focal_px, camera.aspect, camera.principal_px, camera.k1, camera.k2, camera.position_m,
                camera.rotation_rad, camera.gelIndex, camera.windowIndex, camera.windowThickness_m);
  for (const RefractingSurface& surface : camera.surfaces) {
    requireFinite(surface.centre_m, surface.radii_m, surface.index);
  }
  if (description.zero) requireFinite(description.zero->restPosition_px);
  if (const auto& body = description.body) {
    requireFinite(body->nodePositions_m, body->nodeNormals, body->nodeAreas_m2, body->markerPositions_m);
  }
}

Description descriptionOf(const pb::Description& from) {
  Description description;
  description.header = headerOf(from.header());
  description.softwareVersion = from.software_version();
  description.sameHost = isThisHost(from.host());
  description.topics.assign(from.topics().begin(), from.topics().end());
  description.gel = {from.gel().youngs_modulus_pa(), from.gel().poisson_ratio(), vectorOf(from.gel().size_m())};
  for (const pb::MarkerLayer& layer : from.layers()) {
    const Grid grid{layer.columns(), layer.rows(), layer.pitch_m(), vectorOf(layer.centre_m())};
    description.layers.push_back(
        {enumOf(layer.colour(), Colour::kGrey), grid, layer.depth_m(), layer.diameter_m(), layer.darker()});
  }
  const pb::NodeGrid& nodes = from.nodes();
  description.nodes = {nodes.columns(), nodes.rows(), nodes.pitch_m(), vectorOf(nodes.centre_m())};
  description.camera = cameraOf(from.camera());
  const pb::Solver& solver = from.solver();
  description.solver = {solver.mechanics(),
                        solver.regularisation(),
                        solver.strength(),
                        solver.contact_aware(),
                        solver.noise_px(),
                        solver.force_scale_n(),
                        solver.detection_limit_tangential_n(),
                        solver.detection_limit_normal_n()};
  description.calibration = {idOf(from.calibration().id()), from.calibration().time_ns()};
  if (from.has_zero()) description.zero = zeroOf(from.zero());
  if (from.has_body()) description.body = bodyOf(from.body());
  requireFiniteGeometry(description);
  return description;
}

Status statusOf(pb::Status from) {
  const pb::Latencies& latencies = from.latencies();
  for (const pb::Quantiles* each : {&latencies.track(), &latencies.solve(), &latencies.send(), &latencies.total()}) {
    const pb::Histogram& all = each->since_start();
    require(all.count().empty() || all.count_size() == all.bound_s_size() + 1,
            "a histogram has no count for each bound");
  }
  return {headerOf(from.header()), std::make_shared<const pb::Status>(std::move(from))};
}

Field decodeField(std::string_view bytes) {
  const auto from = parse<pb::Field>(bytes);
  Field field;
  field.header = headerOf(from.header());
  field.valid = from.valid();
  field.force_N = vectorsOf<3>(from.force_n());
  field.nodeValid = maskOf(from.node_valid());
  require(field.nodeValid.size() == field.force_N.size(), "the field's mask has another size");
  field.resultant_N = vectorOf(from.resultant_n());
  field.moment_Nm = vectorOf(from.moment_nm());
  field.centreOfPressure_m = vectorOf(from.centre_of_pressure_m());
  field.centreOfPressureValid = from.centre_of_pressure_valid();
  field.residual_px = from.residual_px();
  field.validMarkers = from.valid_markers();
  field.resultantCovariance_N2 = covarianceOf(from.resultant_covariance_n2());
  field.momentCovariance_N2m2 = covarianceOf(from.moment_covariance_n2m2());
  field.resultantMomentCovariance_N2m = covarianceOf(from.resultant_moment_covariance_n2m());
  field.nodeDeviation_N = vectorsOf<3>(from.node_deviation_n());
  require(field.nodeDeviation_N.empty() || field.nodeDeviation_N.size() == field.force_N.size(),
          "the field's deviations have another size");
  for (const pb::Contact& contact : from.contacts()) field.contacts.push_back(contactOf(contact));
  field.method = enumOf(from.method(), Method::kBlend);
  field.solution = enumOf(from.solution(), Solution::kLinear);
  field.modelFrame = from.model_frame();
  field.regularisation_px_per_N = from.regularisation_px_per_n();
  field.pictureMotion = {vectorOf(from.picture_motion().shift_px()), from.picture_motion().scale(),
                         from.picture_motion().roll_rad()};
  requireFinite(field.force_N, field.nodeDeviation_N, field.resultant_N, field.moment_Nm, field.centreOfPressure_m,
                field.residual_px, field.regularisation_px_per_N, field.pictureMotion.shift_px,
                field.pictureMotion.scale, field.pictureMotion.roll_rad);
  requireFiniteCovariances(field.resultantCovariance_N2, field.momentCovariance_N2m2,
                           field.resultantMomentCovariance_N2m);
  return field;
}

Markers decodeMarkers(std::string_view bytes) {
  const auto from = parse<pb::Markers>(bytes);
  Markers markers;
  markers.header = headerOf(from.header());
  markers.displacement_px = vectorsOf<2>(from.displacement_px());
  markers.variance_px2.assign(from.variance_px2().begin(), from.variance_px2().end());
  markers.valid = maskOf(from.marker_valid());
  require(markers.valid.size() == markers.displacement_px.size() &&
              markers.variance_px2.size() == markers.displacement_px.size(),
          "the markers' arrays have different sizes");
  requireFinite(markers.displacement_px, markers.variance_px2);
  markers.validMarkers = from.valid_markers();
  return markers;
}

Description decodeDescription(std::string_view bytes) {
  return descriptionOf(parse<pb::Description>(bytes));
}

Status decodeStatus(std::string_view bytes) {
  return statusOf(parse<pb::Status>(bytes));
}

Contacts decodeContacts(std::string_view bytes) {
  const auto from = parse<pb::Contacts>(bytes);
  Contacts contacts{headerOf(from.header()), idOf(from.run()), from.valid(), {}, {}};
  for (const pb::TrackedContact& each : from.contacts()) contacts.contacts.push_back(contactOf(each));
  for (const pb::CriticalPoint& each : from.critical_points()) contacts.criticalPoints.push_back(pointOf(each));
  return contacts;
}

Grasp decodeGrasp(std::string_view bytes) {
  const auto from = parse<pb::Grasp>(bytes);
  Grasp grasp;
  takeWrench(from, grasp);
  grasp.header = headerOf(from.header());
  grasp.valid = from.valid();
  for (const pb::Finger& each : from.fingers()) grasp.fingers.push_back(fingerOf(each));
  return grasp;
}

Preview decodePreview(std::string_view bytes) {
  const auto from = parse<pb::Preview>(bytes);
  Preview preview;
  preview.header = headerOf(from.header());
  preview.width = from.width();
  preview.height = from.height();
  preview.channels = from.format() == pb::PREVIEW_FORMAT_MONO8 ? 1 : 3;
  require(from.format() == pb::PREVIEW_FORMAT_MONO8 || from.format() == pb::PREVIEW_FORMAT_RGB8,
          "the preview's format is unknown");
  // Compares one factor after another: the product of all three may exceed 64 bits.
  const std::size_t row = std::size_t{preview.width} * preview.channels;
  require(row == 0 || preview.height == 0
              ? from.pixels().empty()
              : from.pixels().size() % row == 0 && from.pixels().size() / row == preview.height,
          "the preview has more or fewer pixels than its size says");
  preview.pixels.assign(from.pixels().begin(), from.pixels().end());
  preview.scale = from.scale();
  preview.origin_px = vectorOf(from.origin_px());
  requireFinite(preview.scale, preview.origin_px);
  return preview;
}

}  // namespace traction
