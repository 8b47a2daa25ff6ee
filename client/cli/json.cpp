#include "client/cli/json.h"

#include "client/cli/json_writer.h"

#include <algorithm>

namespace traction::cli {

namespace {

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
  if (header.flags & kZeroUnverified) json.string("zero_unverified");
  if (header.flags & kFewMarkers) json.string("few_markers");
  if (header.flags & kDiscontinuity) json.string("discontinuity");
  if (header.flags & kReacquiring) json.string("reacquiring");
  if (header.flags & kTorn) json.string("torn");
  if (header.flags & kUnexplained) json.string("unexplained");
  if (header.flags & kOutOfRange) json.string("out_of_range");
  if (header.flags & kGelMismatch) json.string("gel_mismatch");
  if (header.flags & kDoubtedOrigin) json.string("doubted_origin");
  json.close(']');
  json.key("camera_frame_id").number(header.cameraFrameId);
  json.key("frame_number").number(header.frameNumber);
  json.key("device_time_ns").number(header.deviceTime_ns);
  json.key("exposure_s").number(header.exposure_s);
  put(json, "gain", header.gain);
  json.key("line_status");
  header.lineStatus ? json.number(*header.lineStatus) : json.null();
  json.key("received_real_ns").number(header.receivedReal_ns);
  json.key("captured_ns").number(header.captured_ns);
  json.key("captured_error_ns").number(header.capturedError_ns);
  json.key("captured_bound")
      .string(header.capturedBound == CaptureBound::kBoth     ? "both"
              : header.capturedBound == CaptureBound::kLatest ? "latest"
                                                              : "none");
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

const char* nameOf(Method method) {
  switch (method) {
  case Method::kNone:
    return "none";
  case Method::kNoContact:
    return "no_contact";
  case Method::kContact:
    return "contact";
  case Method::kWholeFace:
    return "whole_face";
  case Method::kBlend:
    return "blend";
  }
  return "none";
}

void put(Json& json, const Contact& contact) {
  json.open('{');
  json.key("position_m").numbers(contact.position_m);
  json.key("position_deviation_m").numbers(contact.positionDeviation_m);
  json.key("force_N").numbers(contact.force_N);
  json.key("force_deviation_N").numbers(contact.forceDeviation_N);
  json.key("area_m2").number(contact.area_m2);
  json.key("area_deviation_m2").number(contact.areaDeviation_m2);
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
  json.key("method").string(nameOf(field.method));
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

void put(Json& json, const Markers& markers) {
  put(json, "markers", markers.header);
  json.key("valid_markers").number(markers.validMarkers);
  json.key("displacement_px").vectors(markers.displacement_px);
  json.key("variance_px2").numbers(markers.variance_px2);
  json.key("marker_valid").booleans(markers.valid);
}

/// RFC 4648.
std::string toBase64(const std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = bytes.size() - i;
    const std::uint32_t three = bytes[i] << 16U | (left > 1 ? bytes[i + 1] << 8U : 0U) | (left > 2 ? bytes[i + 2] : 0U);
    text += kLetters[three >> 18U];
    text += kLetters[(three >> 12U) & 63U];
    text += left > 1 ? kLetters[(three >> 6U) & 63U] : '=';
    text += left > 2 ? kLetters[three & 63U] : '=';
  }
  return text;
}

void put(Json& json, const Preview& preview) {
  put(json, "preview", preview.header);
  json.key("width").number(preview.width);
  json.key("height").number(preview.height);
  json.key("format").string(preview.channels == 1 ? "mono8" : "rgb8");
  json.key("scale").number(preview.scale);
  json.key("origin_px").numbers(preview.origin_px);
  json.key("pixels").string(toBase64(preview.pixels));
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
    json.open('{').key("colour").string(cli::nameOf(layer.colour));
    json.key("contrast").string(layer.darker ? "darker" : "brighter");
    put(json, layer.grid);
    json.key("depth_m").number(layer.depth_m);
    json.key("diameter_m").number(layer.diameter_m).close('}');
  }
  json.close(']');
  json.key("nodes").open('{');
  put(json, description.nodes);
  json.close('}');
  const Camera& camera = description.camera;
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
  json.close('}');
  json.key("solver").open('{');
  json.key("mechanics").string(description.solver.mechanics);
  json.key("regularisation").string(description.solver.regularisation);
  json.key("strength").number(description.solver.strength);
  json.key("contact_aware").boolean(description.solver.contactAware);
  json.key("noise_px").number(description.solver.noise_px);
  json.key("force_scale_N").number(description.solver.forceScale_N);
  json.key("detection_limit_tangential_N").number(description.solver.detectionLimitTangential_N);
  json.key("detection_limit_normal_N").number(description.solver.detectionLimitNormal_N);
  json.close('}');
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

void put(Json& json, const char* name, const Quantiles& quantiles) {
  json.key(name).open('{');
  json.key("p50_s").number(quantiles.p50_s);
  json.key("p99_s").number(quantiles.p99_s);
  json.key("max_s").number(quantiles.max_s);
  const Histogram& all = quantiles.sinceStart;
  json.key("since_start").open('{');
  json.key("bound_s").numbers(all.bounds_s);
  json.key("count").open('[');
  for (const std::uint64_t count : all.counts) json.number(count);
  json.close(']');
  json.key("sum_s").number(all.sum_s).close('}').close('}');
}

void put(Json& json, const Status& status) {
  put(json, "status", status.header);
  json.key("uptime_s").number(status.uptime_s);
  json.key("camera").string(cli::nameOf(status.camera));
  const Ledger& ledger = status.ledger;
  json.key("ledger").open('{');
  json.key("received").number(ledger.received);
  json.key("published").number(ledger.published);
  json.key("in_flight").number(ledger.inFlight);
  for (const auto& [cause, frames] : lossesOf(ledger)) json.key(cause).number(frames);
  json.key("missing").number(ledger.missing);
  json.key("reconnects").number(ledger.reconnects);
  json.key("doubted").number(ledger.doubted);
  json.key("invalid").number(ledger.invalid).close('}');
  json.key("rates").open('{');
  json.key("received_hz").number(status.received_hz);
  json.key("published_hz").number(status.published_hz).close('}');
  json.key("latencies").open('{');
  put(json, "track", status.track);
  put(json, "solve", status.solve);
  put(json, "send", status.send);
  put(json, "total", status.total);
  json.close('}');
  json.key("turns").open('{');
  constexpr std::array<const char*, 5> kLoops = {"capture", "track", "solve", "publish", "control"};
  for (std::size_t i = 0; i < kLoops.size(); ++i) json.key(kLoops[i]).number(status.turns[i]);
  json.close('}');
  json.key("camera_why").string(status.cameraWhy);
  json.key("camera_link");
  if (const auto& link = status.cameraLink) {
    json.open('{');
    json.key("packets_resent").number(link->packetsResent);
    json.key("packets_missing").number(link->packetsMissing);
    json.key("packets_refused").number(link->packetsRefused);
    json.key("ptp").string(link->ptp);
    put(json, "ptp_offset_s", link->ptpOffset_s);
    put(json, "temperature", link->temperature_C);
    json.close('}');
  } else {
    json.null();
  }
  json.key("zero_within_s").number(status.zeroWithin_s);
  json.key("log_lines_lost").number(status.logLinesLost);
  json.key("memory_bytes").number(status.memory_bytes);
  json.key("invalid_why").string(status.invalidWhy);
  json.key("unreleased_why").string(status.unreleasedWhy);
  json.key("residual_px").number(status.residual_px);
  const Scheduling& scheduling = status.scheduling;
  json.key("scheduling").open('{');
  json.key("asked_priority").number(scheduling.askedPriority);
  json.key("asked_cpus").string(scheduling.askedCpus);
  json.key("asked_lock").boolean(scheduling.askedLock);
  json.key("threads").open('[');
  for (const Scheduling::Thread& thread : scheduling.threads) {
    json.open('{').key("name").string(thread.name);
    json.key("priority").number(thread.priority);
    json.key("cpus").string(thread.cpus).close('}');
  }
  json.close(']');
  json.key("locked_bytes").number(scheduling.locked_bytes).close('}');
  json.key("markers").open('{').key("layers").open('[');
  for (const MarkerStatus::Layer& layer : status.markers.layers) {
    json.open('{').key("colour").string(cli::nameOf(layer.colour));
    json.key("expected").number(layer.expected);
    json.key("found").number(layer.found);
    json.key("in_zero").number(layer.inZero);
    json.key("columns").number(layer.columns);
    json.key("rows").number(layer.rows).close('}');
  }
  json.close(']');
  json.key("remark").string(status.markers.remark);
  json.key("findings").open('[');
  for (const MarkerStatus::Finding& finding : status.markers.findings) {
    json.open('{').key("name").string(finding.name);
    json.key("expected").number(finding.expected);
    json.key("seen").number(finding.seen);
    json.key("deviation").number(finding.deviation);
    json.key("contradicts").boolean(finding.contradicts).close('}');
  }
  json.close(']').close('}');
  json.key("rest_drift");
  if (const auto& drift = status.restDrift) {
    json.open('{');
    json.key("shift_u_px").number(drift->shiftU_px);
    json.key("shift_v_px").number(drift->shiftV_px);
    json.key("scale").number(drift->scale);
    json.key("roll_rad").number(drift->roll);
    json.key("rms_px").number(drift->rms_px);
    json.key("age_s").number(drift->age_s).close('}');
  } else {
    json.null();
  }
}

const char* nameOf(CameraFeature::Kind kind) {
  using Kind = CameraFeature::Kind;
  switch (kind) {
  case Kind::kInteger:
    return "integer";
  case Kind::kFloat:
    return "float";
  case Kind::kBoolean:
    return "boolean";
  case Kind::kEnumeration:
    return "enumeration";
  case Kind::kString:
    return "string";
  case Kind::kCommand:
    return "command";
  case Kind::kRegister:
    return "register";
  case Kind::kUnknown:
    break;
  }
  return "unknown";
}

const char* nameOf(CameraFeature::Access access) {
  constexpr std::array<const char*, 4> kNames = {"none", "read", "write", "read-write"};
  return kNames[static_cast<std::size_t>(access)];
}

/// False: the text is no such number.
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
  json.key("kind").string(nameOf(feature.kind));
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

const char* nameOf(CameraState state) {
  switch (state) {
  case CameraState::kWaiting:
    return "waiting";
  case CameraState::kStreaming:
    return "streaming";
  case CameraState::kLost:
    return "lost";
  case CameraState::kConnecting:
    return "connecting";
  case CameraState::kUnknown:
    break;
  }
  return "unknown";
}

const char* nameOf(Colour colour) {
  switch (colour) {
  case Colour::kBlue:
    return "blue";
  case Colour::kRed:
    return "red";
  case Colour::kGreen:
    return "green";
  case Colour::kGrey:
    return "grey";
  case Colour::kUnknown:
    break;
  }
  return "unknown";
}

std::array<std::pair<const char*, std::uint64_t>, 11> lossesOf(const Ledger& ledger) {
  return {{{"incomplete", ledger.incomplete},
           {"wrong_size", ledger.wrongSize},
           {"wrong_format", ledger.wrongFormat},
           {"stale", ledger.stale},
           {"implausible", ledger.implausible},
           {"evicted_before_track", ledger.evictedBeforeTrack},
           {"no_rest_pose", ledger.noRestPose},
           {"no_gel", ledger.noGel},
           {"evicted_before_solve", ledger.evictedBeforeSolve},
           {"evicted_before_publish", ledger.evictedBeforePublish},
           {"discarded_at_stop", ledger.discardedAtStop}}};
}

std::string grantedOf(const Scheduling& scheduling) {
  std::string text;
  if (!scheduling.threads.empty()) {
    const auto [low, high] = std::minmax_element(
        scheduling.threads.begin(), scheduling.threads.end(),
        [](const Scheduling::Thread& a, const Scheduling::Thread& b) { return a.priority < b.priority; });
    if (high->priority > 0) text = "priority " + std::to_string(low->priority);
    if (high->priority > low->priority) text += " to " + std::to_string(high->priority);
    if (!scheduling.askedCpus.empty()) text += (text.empty() ? "on " : " on ") + high->cpus;
  }
  if (scheduling.locked_bytes > 0) text += text.empty() ? "memory locked" : ", memory locked";
  return text.empty() ? "off" : text;
}

std::string refusedOf(const Scheduling& scheduling) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  const auto any = [&](auto&& isRefused) {
    return std::any_of(scheduling.threads.begin(), scheduling.threads.end(), isRefused);
  };
  if (scheduling.askedPriority > 0 && any([](const Scheduling::Thread& one) { return one.priority == 0; }))
    add("priority " + std::to_string(scheduling.askedPriority));
  if (!scheduling.askedCpus.empty() &&
      any([&](const Scheduling::Thread& one) { return one.cpus != scheduling.askedCpus; }))
    add("processors " + scheduling.askedCpus);
  if (scheduling.askedLock && scheduling.locked_bytes == 0) add("memory");
  return text;
}

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

}  // namespace traction::cli
