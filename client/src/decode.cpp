#include "client/src/decode.h"

#include "traction/v1/control.pb.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/field.pb.h"
#include "traction/v1/markers.pb.h"
#include "traction/v1/status.pb.h"

#include <algorithm>
#include <cstring>
#include <fstream>

namespace traction {

namespace {

namespace pb = traction::v1;

constexpr std::uint32_t kVersion = 1;

static_assert(static_cast<int>(kZeroUnverified) == pb::FLAG_ZERO_UNVERIFIED);
static_assert(static_cast<int>(kFewMarkers) == pb::FLAG_FEW_MARKERS);
static_assert(static_cast<int>(kDiscontinuity) == pb::FLAG_DISCONTINUITY);
static_assert(static_cast<int>(kReacquiring) == pb::FLAG_REACQUIRING);
static_assert(static_cast<int>(kTorn) == pb::FLAG_TORN);
static_assert(static_cast<int>(kDoubtedOrigin) == pb::FLAG_DOUBTED_ORIGIN);

void require(bool condition, const char* what) {
  if (!condition) throw Error(ErrorCode::kMalformed, what);
}

template <typename Parsed>
Parsed parse(std::string_view bytes) {
  Parsed message;
  require(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())),
          "what arrived is no message of tractiond");
  return message;
}

Id idOf(const std::string& bytes) {
  Id id{};
  require(bytes.empty() || bytes.size() == id.size(), "an id has not 16 bytes");
  std::copy(bytes.begin(), bytes.end(), id.begin());
  return id;
}

std::vector<std::uint8_t> maskOf(const std::string& bytes) {
  return {bytes.begin(), bytes.end()};
}

/// x y z x y z ... -> vectors of kSize.
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
  header.receivedReal_ns = from.received_real_ns();
  header.received_ns = from.received_ns();
  header.captured_ns = from.captured_ns();
  header.capturedError_ns = from.captured_error_ns();
  header.capturedBound = from.captured_bound() == pb::CAPTURE_BOUND_BOTH     ? CaptureBound::kBoth
                         : from.captured_bound() == pb::CAPTURE_BOUND_LATEST ? CaptureBound::kLatest
                                                                             : CaptureBound::kNone;
  header.tracked_ns = from.tracked_ns();
  header.solved_ns = from.solved_ns();
  header.sent_ns = from.sent_ns();
  return header;
}

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
  camera.principal_px = vectorOf(from.principal_px());
  camera.k1 = from.k1();
  camera.k2 = from.k2();
  camera.position_m = vectorOf(from.position_m());
  camera.rotation_rad = vectorOf(from.rotation_rad());
  camera.gelIndex = from.gel_index();
  camera.windowIndex = from.window_index();
  camera.windowThickness_m = from.window_thickness_m();
  return camera;
}

Colour colourOf(pb::Colour colour) {
  switch (colour) {
  case pb::COLOUR_BLUE:
    return Colour::kBlue;
  case pb::COLOUR_RED:
    return Colour::kRed;
  case pb::COLOUR_GREEN:
    return Colour::kGreen;
  case pb::COLOUR_GREY:
    return Colour::kGrey;
  default:
    return Colour::kUnknown;
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
    description.layers.push_back({colourOf(layer.colour()), grid, layer.depth_m(), layer.diameter_m(), layer.darker()});
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
  return description;
}

Quantiles quantilesOf(const pb::Quantiles& from) {
  const pb::Histogram& all = from.since_start();
  require(all.count().empty() || all.count_size() == all.bound_s_size() + 1, "a histogram has no count for each bound");
  return {from.p50_s(),
          from.p99_s(),
          from.max_s(),
          {{all.bound_s().begin(), all.bound_s().end()}, {all.count().begin(), all.count().end()}, all.sum_s()}};
}

Status statusOf(const pb::Status& from) {
  Status status;
  status.header = headerOf(from.header());
  status.uptime_s = from.uptime_s();
  status.zeroWithin_s = from.zero_within_s();
  status.logLinesLost = from.log_lines_lost();
  status.memory_bytes = from.memory_bytes();
  status.residual_px = from.residual_px();
  switch (from.camera()) {
  case pb::CAMERA_STATE_WAITING:
    status.camera = CameraState::kWaiting;
    break;
  case pb::CAMERA_STATE_STREAMING:
    status.camera = CameraState::kStreaming;
    break;
  case pb::CAMERA_STATE_LOST:
    status.camera = CameraState::kLost;
    break;
  case pb::CAMERA_STATE_CONNECTING:
    status.camera = CameraState::kConnecting;
    break;
  default:
    status.camera = CameraState::kUnknown;
  }
  status.cameraWhy = from.camera_why();
  if (from.has_camera_link()) {
    const pb::CameraLink& link = from.camera_link();
    CameraLink& to = status.cameraLink.emplace();
    to.packetsResent = link.packets_resent();
    to.packetsMissing = link.packets_missing();
    to.packetsRefused = link.packets_refused();
    to.ptp = link.ptp();
    if (link.has_ptp_offset_s()) to.ptpOffset_s = link.ptp_offset_s();
    if (link.has_temperature()) to.temperature_C = link.temperature();
  }
  const pb::Ledger& account = from.ledger();
  Ledger& ledger = status.ledger;
  ledger.received = account.received();
  ledger.published = account.published();
  ledger.inFlight = account.in_flight();
  ledger.incomplete = account.incomplete();
  ledger.wrongSize = account.wrong_size();
  ledger.wrongFormat = account.wrong_format();
  ledger.stale = account.stale();
  ledger.implausible = account.implausible();
  ledger.evictedBeforeTrack = account.evicted_before_track();
  ledger.noRestPose = account.no_rest_pose();
  ledger.evictedBeforeSolve = account.evicted_before_solve();
  ledger.evictedBeforePublish = account.evicted_before_publish();
  ledger.discardedAtStop = account.discarded_at_stop();
  ledger.missing = account.missing();
  ledger.reconnects = account.reconnects();
  ledger.doubted = account.doubted();
  status.received_hz = from.rates().received_hz();
  status.published_hz = from.rates().published_hz();
  status.track = quantilesOf(from.latencies().track());
  status.solve = quantilesOf(from.latencies().solve());
  status.send = quantilesOf(from.latencies().send());
  status.total = quantilesOf(from.latencies().total());
  const pb::Turns& turns = from.turns();
  if (from.has_rest_drift()) {
    const pb::RestDrift& drift = from.rest_drift();
    status.restDrift = RestDrift{drift.shift_u_px(), drift.shift_v_px(), drift.scale(),
                                 drift.roll_rad(),   drift.rms_px(),     drift.age_s()};
  }
  for (const pb::LayerStatus& layer : from.markers().layers()) {
    status.markers.layers.push_back(
        {colourOf(layer.colour()), layer.expected(), layer.found(), layer.in_zero(), layer.columns(), layer.rows()});
  }
  status.markers.remark = from.markers().remark();
  for (const pb::GelFinding& finding : from.markers().findings()) {
    status.markers.findings.push_back(
        {finding.name(), finding.expected(), finding.seen(), finding.deviation(), finding.contradicts()});
  }
  status.turns = {turns.capture(), turns.track(), turns.solve(), turns.publish(), turns.control()};
  return status;
}

/// Zero where the daemon does not tell.
Matrix3 matrixOf(const google::protobuf::RepeatedField<double>& from) {
  Matrix3 matrix{};
  require(from.empty() || from.size() == static_cast<int>(matrix.size()), "a covariance is not 3 x 3");
  std::copy(from.begin(), from.end(), matrix.begin());
  return matrix;
}

Covariance covarianceOf(const pb::Covariance& from) {
  return {matrixOf(from.noise()), matrixOf(from.systematic())};
}

Contact contactOf(const pb::Contact& from) {
  return {vectorOf(from.position_m()),
          vectorOf(from.position_deviation_m()),
          vectorOf(from.force_n()),
          vectorOf(from.force_deviation_n()),
          from.area_m2(),
          from.area_deviation_m2()};
}

/// kNone for one of a later daemon.
Method methodOf(pb::Method from) {
  switch (from) {
  case pb::METHOD_NO_CONTACT:
    return Method::kNoContact;
  case pb::METHOD_CONTACT:
    return Method::kContact;
  case pb::METHOD_WHOLE_FACE:
    return Method::kWholeFace;
  case pb::METHOD_BLEND:
    return Method::kBlend;
  default:
    return Method::kNone;
  }
}

/// kUnknown for one of a later daemon.
CameraFeature::Kind kindOf(pb::CameraFeatureKind from) {
  using Kind = CameraFeature::Kind;
  switch (from) {
  case pb::CAMERA_FEATURE_KIND_INTEGER:
    return Kind::kInteger;
  case pb::CAMERA_FEATURE_KIND_FLOAT:
    return Kind::kFloat;
  case pb::CAMERA_FEATURE_KIND_BOOLEAN:
    return Kind::kBoolean;
  case pb::CAMERA_FEATURE_KIND_ENUMERATION:
    return Kind::kEnumeration;
  case pb::CAMERA_FEATURE_KIND_STRING:
    return Kind::kString;
  case pb::CAMERA_FEATURE_KIND_COMMAND:
    return Kind::kCommand;
  case pb::CAMERA_FEATURE_KIND_REGISTER:
    return Kind::kRegister;
  default:
    return Kind::kUnknown;
  }
}

CameraFeature::Access accessOf(pb::CameraFeatureAccess from) {
  using Access = CameraFeature::Access;
  switch (from) {
  case pb::CAMERA_FEATURE_ACCESS_READ:
    return Access::kRead;
  case pb::CAMERA_FEATURE_ACCESS_WRITE:
    return Access::kWrite;
  case pb::CAMERA_FEATURE_ACCESS_READ_WRITE:
    return Access::kReadWrite;
  default:
    return Access::kNone;
  }
}

CameraFeature featureOf(const pb::CameraFeature& from) {
  CameraFeature feature;
  feature.name = from.name();
  feature.value = from.value();
  feature.unit = from.unit();
  feature.kind = kindOf(from.kind());
  feature.access = accessOf(from.access());
  if (from.has_minimum()) feature.minimum = from.minimum();
  if (from.has_maximum()) feature.maximum = from.maximum();
  if (from.has_increment()) feature.increment = from.increment();
  feature.entries.assign(from.entries().begin(), from.entries().end());
  feature.description = from.description();
  feature.configured = from.configured();
  feature.first = from.first();
  feature.category = from.category();
  feature.selected.assign(from.selected().begin(), from.selected().end());
  return feature;
}

/// A reply that answers `expected`.
pb::Reply replyOf(std::string_view bytes, pb::Reply::ReplyCase expected) {
  auto reply = parse<pb::Reply>(bytes);
  if (reply.version() != kVersion) {
    throw Error(ErrorCode::kVersion, "the daemon speaks version " + std::to_string(reply.version()) +
                                         " of the protocol, this library " + std::to_string(kVersion));
  }
  if (!reply.error().empty()) throw Error(ErrorCode::kRefused, reply.error());
  require(reply.reply_case() == expected, "the reply does not answer the request");
  return reply;
}

}  // namespace

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
  field.method = methodOf(from.method());
  field.regularisation_px_per_N = from.regularisation_px_per_n();
  field.pictureMotion = {vectorOf(from.picture_motion().shift_px()), from.picture_motion().scale(),
                         from.picture_motion().roll_rad()};
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
  markers.validMarkers = from.valid_markers();
  return markers;
}

Description decodeDescription(std::string_view bytes) {
  return descriptionOf(parse<pb::Description>(bytes));
}

Status decodeStatus(std::string_view bytes) {
  return statusOf(parse<pb::Status>(bytes));
}

std::string encodeRequest(Request request) {
  pb::Request message;
  message.set_version(kVersion);
  switch (request) {
  case Request::kStatus:
    message.mutable_status();
    break;
  case Request::kDescription:
    message.mutable_description();
    break;
  case Request::kSnapshot:
    message.mutable_snapshot();
    break;
  }
  return message.SerializeAsString();
}

std::string encodeZero(const ZeroRequest& zero) {
  pb::Request message;
  message.set_version(kVersion);
  message.mutable_zero()->set_anyway(zero.anyway);
  message.mutable_zero()->set_undo(zero.undo);
  return message.SerializeAsString();
}

std::string encodeCalibration(const CalibrationStep& step) {
  pb::Request message;
  message.set_version(kVersion);
  pb::CalibrateRequest& request = *message.mutable_calibrate();
  switch (step.kind) {
  case CalibrationStep::Kind::kGeometry:
    request.mutable_geometry()->set_anyway(step.anyway);
    break;
  case CalibrationStep::Kind::kNoise:
    request.mutable_noise()->set_duration_s(step.seconds);
    request.mutable_noise()->set_anyway(step.anyway);
    break;
  case CalibrationStep::Kind::kWeight:
    request.mutable_weight()->set_weight_n(step.weight_N);
    request.mutable_weight()->set_patience_s(step.seconds);
    request.mutable_weight()->set_first(step.first);
    break;
  case CalibrationStep::Kind::kStiffness:
    request.mutable_stiffness();
    break;
  case CalibrationStep::Kind::kFinish:
    request.mutable_finish()->set_name(step.name);
    break;
  }
  return message.SerializeAsString();
}

std::string encodeCameraStep(const CameraStep& step) {
  pb::Request message;
  message.set_version(kVersion);
  pb::CameraRequest& request = *message.mutable_camera();
  switch (step.kind) {
  case CameraStep::Kind::kList:
    request.mutable_list()->set_matching(step.matching);
    for (const std::string& category : step.categories) request.mutable_list()->add_categories(category);
    break;
  case CameraStep::Kind::kRead:
    request.mutable_read()->set_name(step.name);
    break;
  case CameraStep::Kind::kWrite:
    request.mutable_write()->set_name(step.name);
    request.mutable_write()->set_value(step.value);
    break;
  case CameraStep::Kind::kExecute:
    request.mutable_execute()->set_name(step.name);
    break;
  case CameraStep::Kind::kBalanceWhite:
    request.mutable_balance_white();
    break;
  case CameraStep::Kind::kTrigger:
    request.mutable_trigger();
    break;
  }
  return message.SerializeAsString();
}

Status decodeStatusReply(std::string_view bytes) {
  return statusOf(replyOf(bytes, pb::Reply::kStatus).status());
}

Description decodeDescriptionReply(std::string_view bytes) {
  return descriptionOf(replyOf(bytes, pb::Reply::kDescription).description());
}

ZeroResult decodeZeroReply(std::string_view bytes) {
  const pb::Reply reply = replyOf(bytes, pb::Reply::kZero);
  const pb::ZeroReply& from = reply.zero();
  return {zeroOf(from.zero()), from.markers_present(), from.markers_expected(), from.noise_levels(), from.remark()};
}

Snapshot decodeSnapshotReply(std::string_view bytes) {
  const pb::Reply reply = replyOf(bytes, pb::Reply::kSnapshot);
  const pb::SnapshotReply& from = reply.snapshot();
  Snapshot snapshot;
  snapshot.width = from.width();
  snapshot.height = from.height();
  snapshot.channels = from.channels();
  snapshot.reduced = std::max(from.reduced(), 1U);
  const auto size = std::uint64_t{from.width()} * from.height() * from.channels();
  require((from.channels() == 1 || from.channels() == 3) && from.levels().size() == size,
          "the picture has not the size that it says");
  snapshot.levels.assign(from.levels().begin(), from.levels().end());
  snapshot.pixelFormat = from.pixel_format();
  snapshot.frameNumber = from.frame_number();
  snapshot.receivedReal_ns = from.received_real_ns();
  const auto colourAt = [&from](char layer) {
    const int index = static_cast<unsigned char>(layer);
    return index < from.colours_size() ? colourOf(from.colours(index)) : Colour::kUnknown;
  };
  const auto placeOf = [](const auto& places, std::size_t i) {
    return std::array<float, 2>{places[static_cast<int>(2 * i)], places[static_cast<int>(2 * i + 1)]};
  };
  const std::size_t markers = from.marker_state().size(), spots = from.spot_layer().size();
  require(from.marker_layer().size() == markers && static_cast<std::size_t>(from.place_px_size()) == 2 * markers &&
              static_cast<std::size_t>(from.spot_px_size()) == 2 * spots,
          "the picture's arrays have different sizes");
  for (std::size_t i = 0; i < markers; ++i) {
    snapshot.markers.push_back({placeOf(from.place_px(), i), colourAt(from.marker_layer()[i]),
                                static_cast<Snapshot::MarkerState>(std::min<char>(from.marker_state()[i], 3))});
  }
  for (std::size_t i = 0; i < spots; ++i) {
    snapshot.spots.push_back({placeOf(from.spot_px(), i), colourAt(from.spot_layer()[i])});
  }
  return snapshot;
}

CalibrationReport decodeCalibrationReply(std::string_view bytes) {
  const pb::Reply reply = replyOf(bytes, pb::Reply::kCalibrate);
  const pb::CalibrateReply& from = reply.calibrate();
  CalibrationReport report;
  for (const pb::Figure& figure : from.figures()) {
    report.figures.push_back({figure.name(), figure.value(), figure.deviation()});
  }
  report.remarks.assign(from.remarks().begin(), from.remarks().end());
  report.path = from.path();
  return report;
}

CameraReport decodeCameraReply(std::string_view bytes) {
  const pb::Reply reply = replyOf(bytes, pb::Reply::kCamera);
  CameraReport report;
  for (const pb::CameraFeature& feature : reply.camera().features()) report.features.push_back(featureOf(feature));
  report.remarks.assign(reply.camera().remarks().begin(), reply.camera().remarks().end());
  report.camera = reply.camera().camera();
  return report;
}

}  // namespace traction
