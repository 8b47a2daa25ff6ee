#include "client/show/json.h"

#include "client/show/base64.h"
#include "client/show/json_writer.h"
#include "client/show/reflection.h"
#include "client/show/scene.h"

#include <array>

namespace traction::client {

namespace {

/// \param type name of the protocol's enum, whose numbers those of the library are
template <typename Enum>
std::string wordOf(const char* type, Enum value) {
  return client::wordOf(type, static_cast<int>(value));
}

void put(Json& json, const char* key, const std::optional<double>& number) {
  json.key(key);
  number ? json.number(*number) : json.null();
}

void put(Json& json, const char* topic, const Header& header) {
  json.key("topic").string(topic);
  json.key("sensor").string(header.sensor);
  json.key("sequence").number(header.sequence);
  json.key("boot").string(toHex(header.boot));
  json.key("calibration").string(toHex(header.calibration));
  json.key("zero").string(toHex(header.zero));
  json.key("flags").open('[');
  for (std::uint32_t bit = 1; bit != 0; bit <<= 1U) {
    for (const FlagText& each : kFlagTexts) {
      if (each.flag == bit && (header.flags & bit) != 0) json.string(each.name);
    }
  }
  json.close(']');
  json.key("camera_frame_id").number(header.cameraFrameId);
  json.key("frame_number").number(header.frameNumber);
  json.key("device_time_ns").number(header.deviceTime_ns);
  json.key("exposure_s").number(header.exposure_s);
  put(json, "gain", header.gain);
  json.key("line_status");
  header.lineStatus ? json.number(*header.lineStatus) : json.null();
  put(json, "camera_temperature", header.cameraTemperature_C);
  json.key("received_real_ns").number(header.receivedReal_ns);
  json.key("captured_ns").number(header.captured_ns);
  json.key("captured_error_ns").number(header.capturedError_ns);
  json.key("captured_bound").string(wordOf("CaptureBound", header.capturedBound));
  json.key("received_ns").number(header.received_ns);
  json.key("tracked_ns").number(header.tracked_ns);
  json.key("solved_ns").number(header.solved_ns);
  json.key("sent_ns").number(header.sent_ns);
  json.key("arrived_ns").number(header.arrived_ns);
}

void put(Json& json, std::string_view key, const Covariance& covariance) {
  json.key(key).open('{');
  json.key("noise").numbers(covariance.noise);
  json.key("systematic").numbers(covariance.systematic);
  json.close('}');
}

/// Of a Contact, a TrackedContact, a Finger or a Grasp.
void putWrench(Json& json, const auto& of) {
  json.key("force_N").numbers(of.force_N);
  json.key("moment_Nm").numbers(of.moment_Nm);
  put(json, "force_covariance_N2", of.forceCovariance_N2);
  put(json, "moment_covariance_N2m2", of.momentCovariance_N2m2);
  put(json, "force_moment_covariance_N2m", of.forceMomentCovariance_N2m);
}

/// Of a Contact or a TrackedContact.
void putWrenchAndEllipse(Json& json, const auto& contact) {
  putWrench(json, contact);
  json.key("force_deviation_N").numbers(contact.forceDeviation_N);
  json.key("position_z_m").number(contact.positionZ_m);
  json.key("half_axes_m").numbers(contact.halfAxes_m);
  json.key("half_axes_deviation_m").numbers(contact.halfAxesDeviation_m);
  json.key("orientation_rad").number(contact.orientation_rad);
  json.key("orientation_deviation_rad").number(contact.orientationDeviation_rad);
}

void put(Json& json, const Contact& contact) {
  json.open('{');
  json.key("position_m").numbers(contact.position_m);
  json.key("position_deviation_m").numbers(contact.positionDeviation_m);
  json.key("area_m2").number(contact.area_m2);
  json.key("area_deviation_m2").number(contact.areaDeviation_m2);
  putWrenchAndEllipse(json, contact);
  json.key("shear_spread_ratio").number(contact.shearSpreadRatio);
  json.key("shear_spread_ratio_deviation").number(contact.shearSpreadRatioDeviation);
  json.key("hertz_radius_m").number(contact.hertzRadius_m);
  json.key("hertz_radius_deviation_m").number(contact.hertzRadiusDeviation_m);
  json.close('}');
}

void put(Json& json, const Field& field) {
  put(json, "field", field.header);
  json.key("valid").boolean(field.valid);
  json.key("resultant_N").numbers(field.resultant_N);
  json.key("moment_Nm").numbers(field.moment_Nm);
  json.key("centre_of_pressure_m");
  field.centreOfPressureValid ? json.numbers(field.centreOfPressure_m) : json.null();
  json.key("residual_px").number(field.residual_px);
  json.key("valid_markers").number(field.validMarkers);
  json.key("method").string(wordOf("Method", field.method));
  json.key("solution").string(wordOf("Solution", field.solution));
  json.key("model_frame").number(field.modelFrame);
  json.key("regularisation_px_per_N").number(field.regularisation_px_per_N);
  put(json, "resultant_covariance_N2", field.resultantCovariance_N2);
  put(json, "moment_covariance_N2m2", field.momentCovariance_N2m2);
  put(json, "resultant_moment_covariance_N2m", field.resultantMomentCovariance_N2m);
  json.key("contacts").open('[');
  for (const Contact& contact : field.contacts) put(json, contact);
  json.close(']');
  json.key("picture_motion").open('{');
  json.key("shift_px").numbers(field.pictureMotion.shift_px);
  json.key("scale").number(field.pictureMotion.scale);
  json.key("roll_rad").number(field.pictureMotion.roll_rad);
  json.close('}');
  json.key("force_N").vectors(field.force_N);
  json.key("node_deviation_N").vectors(field.nodeDeviation_N);
  json.key("node_valid").booleans(field.nodeValid);
}

void put(Json& json, const char* key, const Interval& interval) {
  json.key(key).open('{');
  json.key("estimate").number(interval.estimate);
  json.key("low").number(interval.low);
  json.key("high").number(interval.high);
  json.close('}');
}

void put(Json& json, const Slip& slip) {
  json.open('{');
  json.key("state").string(wordOf("SlipState", slip.state));
  put(json, "stick_ratio", slip.stickRatio);
  put(json, "friction", slip.friction);
  json.key("margin_N").number(slip.margin_N);
  json.key("holding_force_N").number(slip.holdingForce_N);
  json.key("model").string(wordOf("SlipModel", slip.model));
  json.close('}');
}

void put(Json& json, const TrackedContact& contact) {
  json.open('{');
  json.key("id").number(contact.id);
  json.key("phase").string(wordOf("ContactPhase", contact.phase));
  json.key("doubted").boolean(contact.doubted);
  json.key("begun_ns").number(contact.begun_ns);
  json.key("seen_ns").number(contact.seen_ns);
  json.key("position_m").numbers(contact.position_m);
  json.key("position_deviation_m").numbers(contact.positionDeviation_m);
  json.key("radius_m").number(contact.radius_m);
  json.key("radius_deviation_m").number(contact.radiusDeviation_m);
  json.key("velocity_m_s").numbers(contact.velocity_m_s);
  json.key("velocity_deviation_m_s").numbers(contact.velocityDeviation_m_s);
  json.key("slip");
  if (contact.slip)
    put(json, *contact.slip);
  else
    json.null();
  putWrenchAndEllipse(json, contact);
  json.key("angular_velocity_rad_s").number(contact.angularVelocity_rad_s);
  json.key("angular_velocity_deviation_rad_s").number(contact.angularVelocityDeviation_rad_s);
  json.close('}');
}

void put(Json& json, const CriticalPoint& point) {
  json.open('{');
  json.key("id").number(point.id);
  json.key("kind").string(wordOf("CriticalPointKind", point.kind));
  json.key("index").number(point.index);
  json.key("begun_ns").number(point.begun_ns);
  json.key("position_m").numbers(point.position_m);
  json.key("position_deviation_m").numbers(point.positionDeviation_m);
  json.key("strength").number(point.strength);
  json.key("angle_rad").number(point.angle_rad);
  json.close('}');
}

void put(Json& json, const Contacts& contacts) {
  put(json, "contacts", contacts.header);
  json.key("run").string(toHex(contacts.run));
  json.key("valid").boolean(contacts.valid);
  json.key("contacts").open('[');
  for (const TrackedContact& contact : contacts.contacts) put(json, contact);
  json.close(']');
  json.key("critical_points").open('[');
  for (const CriticalPoint& point : contacts.criticalPoints) put(json, point);
  json.close(']');
}

void put(Json& json, const Finger& finger) {
  json.open('{');
  json.key("instance").string(finger.instance);
  json.key("link").string(finger.link);
  json.key("state").string(wordOf("FingerState", finger.state));
  json.key("sensor").string(finger.sensor);
  json.key("frame_number").number(finger.frameNumber);
  json.key("captured_ns").number(finger.captured_ns);
  json.key("captured_error_ns").number(finger.capturedError_ns);
  json.key("captured_bound").string(wordOf("CaptureBound", finger.capturedBound));
  putWrench(json, finger);
  json.close('}');
}

void put(Json& json, const Grasp& grasp) {
  put(json, "grasp", grasp.header);
  json.key("valid").boolean(grasp.valid);
  putWrench(json, grasp);
  json.key("fingers").open('[');
  for (const Finger& finger : grasp.fingers) put(json, finger);
  json.close(']');
}

void put(Json& json, const Markers& markers) {
  put(json, "markers", markers.header);
  json.key("valid_markers").number(markers.validMarkers);
  json.key("displacement_px").vectors(markers.displacement_px);
  json.key("variance_px2").numbers(markers.variance_px2);
  json.key("marker_valid").booleans(markers.valid);
}

void put(Json& json, const Preview& preview) {
  put(json, "preview", preview.header);
  json.key("width").number(preview.width);
  json.key("height").number(preview.height);
  json.key("format").string(preview.channels == 1 ? "mono8" : "rgb8");
  json.key("scale").number(preview.scale);
  json.key("origin_px").numbers(preview.origin_px);
  json.key("pixels").string(base64({reinterpret_cast<const char*>(preview.pixels.data()), preview.pixels.size()}));
}

void put(Json& json, const Grid& grid) {
  json.key("columns").number(grid.columns);
  json.key("rows").number(grid.rows);
  json.key("pitch_m").number(grid.pitch_m);
  json.key("centre_m").numbers(grid.centre_m);
}

void put(Json& json, const Zero& zero) {
  json.key("id").string(toHex(zero.id));
  json.key("time_ns").number(zero.time_ns);
  json.key("requested").boolean(zero.requested);
  json.key("requested_by").string(zero.requestedBy);
}

void put(Json& json, const Camera& camera) {
  json.key("camera").open('{');
  json.key("vendor").string(camera.vendor);
  json.key("model").string(camera.model);
  json.key("serial").string(camera.serial);
  json.key("pixel_format").string(camera.pixelFormat);
  json.key("width_px").number(camera.width_px);
  json.key("height_px").number(camera.height_px);
  json.key("focal_px").number(camera.focal_px);
  json.key("aspect").number(camera.aspect);
  json.key("principal_px").numbers(camera.principal_px);
  json.key("k1").number(camera.k1);
  json.key("k2").number(camera.k2);
  json.key("position_m").numbers(camera.position_m);
  json.key("rotation_rad").numbers(camera.rotation_rad);
  json.key("gel_index").number(camera.gelIndex);
  json.key("window_index").number(camera.windowIndex);
  json.key("window_thickness_m").number(camera.windowThickness_m);
  json.key("surfaces").open('[');
  for (const RefractingSurface& surface : camera.surfaces) {
    json.open('{');
    json.key("centre_m").numbers(surface.centre_m);
    json.key("radii_m").numbers(surface.radii_m);
    json.key("index").number(surface.index);
    json.close('}');
  }
  json.close(']');
  json.close('}');
}

void put(Json& json, const Solver& solver) {
  json.key("solver").open('{');
  json.key("mechanics").string(solver.mechanics);
  json.key("regularisation").string(solver.regularisation);
  json.key("strength").number(solver.strength);
  json.key("contact_aware").boolean(solver.contactAware);
  json.key("noise_px").number(solver.noise_px);
  json.key("force_scale_N").number(solver.forceScale_N);
  json.key("detection_limit_tangential_N").number(solver.detectionLimitTangential_N);
  json.key("detection_limit_normal_N").number(solver.detectionLimitNormal_N);
  json.close('}');
}

void put(Json& json, const Description& description) {
  put(json, "description", description.header);
  json.key("software_version").string(description.softwareVersion);
  json.key("same_host").boolean(description.sameHost);
  json.key("topics").strings(description.topics);
  json.key("gel");
  if (description.hasGel()) {
    json.open('{').key("youngs_modulus_Pa").number(description.gel.youngsModulus_Pa);
    json.key("poisson_ratio").number(description.gel.poissonRatio);
    json.key("size_m").numbers(description.gel.size_m);
    json.close('}');
  } else {
    json.null();
  }
  json.key("layers").open('[');
  for (const MarkerLayer& layer : description.layers) {
    json.open('{').key("colour").string(wordOf("Colour", layer.colour));
    json.key("contrast").string(layer.darker ? "darker" : "brighter");
    put(json, layer.grid);
    json.key("depth_m").number(layer.depth_m);
    json.key("diameter_m").number(layer.diameter_m).close('}');
  }
  json.close(']');
  json.key("nodes").open('{');
  put(json, description.nodes);
  json.close('}');
  put(json, description.camera);
  put(json, description.solver);
  json.key("calibration_time_ns").number(description.calibration.time_ns);
  json.key("rest_pose");
  if (description.zero) {
    json.open('{');
    put(json, *description.zero);
    json.key("rest_position_px").vectors(description.zero->restPosition_px);
    json.key("marker_present").booleans(description.zero->markerPresent).close('}');
  } else {
    json.null();
  }
  json.key("body");
  if (description.body) {
    json.open('{').key("node_positions_m").vectors(description.body->nodePositions_m);
    json.key("node_normals").vectors(description.body->nodeNormals);
    json.key("node_areas_m2").numbers(description.body->nodeAreas_m2);
    json.key("marker_positions_m").vectors(description.body->markerPositions_m).close('}');
  } else {
    json.null();
  }
}

/// Writes the fields of a message under their names, in the order of their declaration.
void putFields(Json& json, const Reflected& message);

void putScalar(Json& json, const Scalar& value) {
  if (const auto* text = std::get_if<std::string>(&value)) {
    json.string(*text);
  } else if (const auto* boolean = std::get_if<bool>(&value)) {
    json.boolean(*boolean);
  } else if (const auto* number = std::get_if<double>(&value)) {
    json.number(*number);
  } else if (const auto* count = std::get_if<std::uint64_t>(&value)) {
    json.number(*count);
  } else {
    json.number(std::get<std::int64_t>(value));
  }
}

// NOLINTBEGIN(misc-no-recursion): as deep as the messages of the schema
void putField(Json& json, const Reflected& message, const FieldDescriptor& field) {
  json.key(field.name());
  if (field.is_repeated()) json.open('[');
  if (isMessage(field)) {
    if (isAbsent(message, field)) json.null();
    forEachMessage(message, field, [&](const Reflected& part, int) {
      json.open('{');
      putFields(json, part);
      json.close('}');
    });
  } else if (field.is_repeated()) {
    for (int i = 0; i < message.GetReflection()->FieldSize(message, &field); ++i)
      putScalar(json, scalarOf(message, field, i));
  } else if (field.has_optional_keyword() && !isSet(message, field)) {
    json.null();
  } else {
    putScalar(json, scalarOf(message, field));
  }
  if (field.is_repeated()) json.close(']');
}

void putFields(Json& json, const Reflected& message) {
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i)
    putField(json, message, *message.GetDescriptor()->field(i));
}
// NOLINTEND(misc-no-recursion)

void put(Json& json, const Status& status) {
  put(json, "status", status.header);
  const auto message = reflected(*status.message);
  for (int i = 0; i < statusDescriptor().field_count(); ++i) {
    const FieldDescriptor& field = *statusDescriptor().field(i);
    if (field.name() != "timestamp" && field.name() != "header") putField(json, *message, field);
  }
}

const char* nameOf(CameraFeature::Access access) {
  constexpr std::array kNames = {"none", "read", "write", "read-write"};
  return kNames.at(static_cast<std::size_t>(access));
}

/// Returns false if the text is not such a number.
template <typename Number>
bool putNumber(Json& json, const std::string& text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return false;
  json.number(number);
  return true;
}

void putValue(Json& json, const char* key, const std::string& text, CameraFeature::Kind kind) {
  using Kind = CameraFeature::Kind;
  json.key(key);
  if (text.empty() && kind != Kind::kString) {
    json.null();
  } else if (kind == Kind::kBoolean && (text == "true" || text == "false")) {
    json.boolean(text == "true");
  } else if (!(kind == Kind::kInteger && putNumber<std::int64_t>(json, text)) &&
             !(kind == Kind::kFloat && putNumber<double>(json, text))) {
    json.string(text);
  }
}

void put(Json& json, const CameraFeature& feature) {
  json.open('{');
  json.key("name").string(feature.name);
  putValue(json, "value", feature.value, feature.kind);
  json.key("unit").string(feature.unit);
  json.key("kind").string(wordOf("CameraFeatureKind", feature.kind));
  json.key("access").string(nameOf(feature.access));
  put(json, "minimum", feature.minimum);
  put(json, "maximum", feature.maximum);
  put(json, "increment", feature.increment);
  json.key("entries").strings(feature.entries);
  json.key("description").string(feature.description);
  putValue(json, "configured", feature.configured, feature.configured.empty() ? CameraFeature::Kind{} : feature.kind);
  putValue(json, "first", feature.first, feature.first.empty() ? CameraFeature::Kind{} : feature.kind);
  json.key("category").string(feature.category);
  json.key("selected").strings(feature.selected);
  json.close('}');
}

void put(Json& json, const CameraReport& report) {
  json.key("camera").string(report.camera);
  json.key("features").open('[');
  for (const CameraFeature& feature : report.features) put(json, feature);
  json.close(']');
  json.key("remarks").strings(report.remarks);
}

template <typename Any>
std::string object(const Any& any) {
  Json json;
  json.open('{');
  put(json, any);
  return json.close('}').take();
}

}  // namespace

std::string toHex(const Id& id) {
  std::string text;
  if (id == Id{}) return text;
  for (const auto byte : id) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

std::string toJson(const Message& message) {
  return std::visit([](const auto& any) { return object(any); }, message);
}

std::string toJson(const Status& status) {
  return object(status);
}

std::string toJson(const Description& description) {
  return object(description);
}

std::string toJson(const ZeroResult& result) {
  Json json;
  json.open('{');
  put(json, result.zero);
  json.key("markers_present").number(result.markersPresent);
  json.key("markers_expected").number(result.markersExpected);
  json.key("noise_levels").number(result.noise_levels);
  json.key("remark").string(result.remark);
  return json.close('}').take();
}

std::string toJson(const CameraReport& report) {
  return object(report);
}

std::string toJson(const std::string& step, const CalibrationReport& report) {
  Json json;
  json.open('{');
  json.key("step").string(step);
  json.key("figures").open('{');
  for (const CalibrationReport::Figure& figure : report.figures) {
    json.key(figure.name.c_str()).open('{');
    json.key("value").number(figure.value);
    json.key("deviation").number(figure.deviation).close('}');
  }
  json.close('}');
  json.key("remarks").strings(report.remarks);
  json.key("path").string(report.path);
  return json.close('}').take();
}

}  // namespace traction::client
