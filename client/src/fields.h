// The fields of the library's messages, each written once: the decoder takes them from the protocol's messages, and
// tractionctl prints them as JSON.
//
// fields(to, from, each) calls each(name, member, value) for every field of a message, in the order of the JSON: its
// name there, or nullptr if it is not printed; the member of the library's struct `to`; its value in the protocol's
// message `from`. JSON needs the value for its type alone.
#pragma once

#include "client/src/messages.h"
#include "traction/v1/contacts.pb.h"
#include "traction/v1/field.pb.h"
#include "traction/v1/grasp.pb.h"
#include "traction/v1/markers.pb.h"

#include <cstdint>
#include <optional>
#include <tuple>

namespace traction {

/// An enum of the library and of the protocol, which have the same numbers.
template <typename Own>
struct WireEnum {
  /// Does not compile if the last enumerators differ.
  constexpr WireEnum(const char* inProtocol, Own ownLast, int wireLast)
      : name(inProtocol)
      , last(static_cast<int>(ownLast) == wireLast ? ownLast : throw "the library lacks enumerators") {}

  const char* name;  ///< in the protocol
  Own last;
};

inline constexpr std::tuple kEnums{
    WireEnum{"CaptureBound", CaptureBound::kLatest, pb::CaptureBound_MAX},
    WireEnum{"Colour", Colour::kGrey, pb::Colour_MAX},
    WireEnum{"ContactPhase", ContactPhase::kEnd, pb::ContactPhase_MAX},
    WireEnum{"CriticalPointKind", CriticalPointKind::kSaddle, pb::CriticalPointKind_MAX},
    WireEnum{"EndCause", EndCause::kStopped, pb::EndCause_MAX},
    WireEnum{"FingerState", FingerState::kAmbiguous, pb::FingerState_MAX},
    WireEnum{"Method", Method::kBlend, pb::Method_MAX},
    WireEnum{"SlipModel", SlipModel::kSliding, pb::SlipModel_MAX},
    WireEnum{"SlipState", SlipState::kSlipping, pb::SlipState_MAX},
    WireEnum{"Solution", Solution::kLinear, pb::Solution_MAX},
};

// Members that JSON prints otherwise than their type says.

/// Null unless it is given.
template <typename Member>
struct Given {
  Member& member;
  bool isGiven;
};
template <typename Member>
Given(Member&, bool) -> Given<Member>;

/// Bits of Header::flags as a list of words.
template <typename Member>
struct Flags {
  Member& member;
};
template <typename Member>
Flags(Member&) -> Flags<Member>;

/// MarkerLayer::darker as a word.
template <typename Member>
struct Contrast {
  Member& member;
};
template <typename Member>
Contrast(Member&) -> Contrast<Member>;

/// \returns nullptr or nothing where the message has no such field
template <typename Value>
const Value* pointerIf(bool isSet, const Value& value) {
  return isSet ? &value : nullptr;
}
template <typename Value>
std::optional<Value> valueIf(bool isSet, Value value) {
  return isSet ? std::optional(value) : std::nullopt;
}

void fields(auto& to, const pb::Header& from, auto&& each) {
  each("sensor", to.sensor, from.sensor());
  each("sequence", to.sequence, from.sequence());
  each("boot", to.boot, from.boot());
  each("calibration", to.calibration, from.calibration());
  each("zero", to.zero, from.zero());
  each("flags", Flags{to.flags}, from.flags());
  each("camera_frame_id", to.cameraFrameId, from.camera_frame_id());
  each("frame_number", to.frameNumber, from.frame_number());
  each("device_time_ns", to.deviceTime_ns, from.device_time_ns());
  each("exposure_s", to.exposure_s, from.exposure_s());
  each("gain", to.gain, valueIf(from.has_gain(), from.gain()));
  each("line_status", to.lineStatus, valueIf(from.has_line_status(), from.line_status()));
  each("camera_temperature", to.cameraTemperature_C, valueIf(from.has_camera_temperature(), from.camera_temperature()));
  each("received_real_ns", to.receivedReal_ns, from.received_real_ns());
  each("captured_ns", to.captured_ns, from.captured_ns());
  each("captured_error_ns", to.capturedError_ns, from.captured_error_ns());
  each("captured_bound", to.capturedBound, from.captured_bound());
  each("received_ns", to.received_ns, from.received_ns());
  each("tracked_ns", to.tracked_ns, from.tracked_ns());
  each("solved_ns", to.solved_ns, from.solved_ns());
  each("sent_ns", to.sent_ns, from.sent_ns());
}

void fields(auto& to, const pb::Covariance& from, auto&& each) {
  each("noise", to.noise, from.noise());
  each("systematic", to.systematic, from.systematic());
}

/// Of a Contact, a TrackedContact, a Finger or a Grasp.
void wrenchFields(auto& to, const auto& from, auto&& each) {
  each("force_N", to.force_N, from.force_n());
  each("moment_Nm", to.moment_Nm, from.moment_nm());
  each("force_covariance_N2", to.forceCovariance_N2, from.force_covariance_n2());
  each("moment_covariance_N2m2", to.momentCovariance_N2m2, from.moment_covariance_n2m2());
  each("force_moment_covariance_N2m", to.forceMomentCovariance_N2m, from.force_moment_covariance_n2m());
}

/// Of a Contact or a TrackedContact.
void contactFields(auto& to, const auto& from, auto&& each) {
  wrenchFields(to, from, each);
  each("force_deviation_N", to.forceDeviation_N, from.force_deviation_n());
  each("position_z_m", to.positionZ_m, from.position_z_m());
  each("half_axes_m", to.halfAxes_m, from.half_axes_m());
  each("half_axes_deviation_m", to.halfAxesDeviation_m, from.half_axes_deviation_m());
  each("orientation_rad", to.orientation_rad, from.orientation_rad());
  each("orientation_deviation_rad", to.orientationDeviation_rad, from.orientation_deviation_rad());
}

void fields(auto& to, const pb::Contact& from, auto&& each) {
  each("position_m", to.position_m, from.position_m());
  each("position_deviation_m", to.positionDeviation_m, from.position_deviation_m());
  each("area_m2", to.area_m2, from.area_m2());
  each("area_deviation_m2", to.areaDeviation_m2, from.area_deviation_m2());
  contactFields(to, from, each);
  each("shear_spread_ratio", to.shearSpreadRatio, from.shear_spread_ratio());
  each("shear_spread_ratio_deviation", to.shearSpreadRatioDeviation, from.shear_spread_ratio_deviation());
  each("hertz_radius_m", to.hertzRadius_m, from.hertz_radius_m());
  each("hertz_radius_deviation_m", to.hertzRadiusDeviation_m, from.hertz_radius_deviation_m());
}

void fields(auto& to, const pb::PictureMotion& from, auto&& each) {
  each("shift_px", to.shift_px, from.shift_px());
  each("scale", to.scale, from.scale());
  each("roll_rad", to.roll_rad, from.roll_rad());
}

void fields(auto& to, const pb::Field& from, auto&& each) {
  each("valid", to.valid, from.valid());
  each("resultant_N", to.resultant_N, from.resultant_n());
  each("moment_Nm", to.moment_Nm, from.moment_nm());
  each("centre_of_pressure_m", Given{to.centreOfPressure_m, to.centreOfPressureValid}, from.centre_of_pressure_m());
  each(nullptr, to.centreOfPressureValid, from.centre_of_pressure_valid());
  each("residual_px", to.residual_px, from.residual_px());
  each("valid_markers", to.validMarkers, from.valid_markers());
  each("method", to.method, from.method());
  each("solution", to.solution, from.solution());
  each("model_frame", to.modelFrame, from.model_frame());
  each("regularisation_px_per_N", to.regularisation_px_per_N, from.regularisation_px_per_n());
  each("resultant_covariance_N2", to.resultantCovariance_N2, from.resultant_covariance_n2());
  each("moment_covariance_N2m2", to.momentCovariance_N2m2, from.moment_covariance_n2m2());
  each("resultant_moment_covariance_N2m", to.resultantMomentCovariance_N2m, from.resultant_moment_covariance_n2m());
  each("contacts", to.contacts, from.contacts());
  each("picture_motion", to.pictureMotion, from.picture_motion());
  each("force_N", to.force_N, from.force_n());
  each("node_deviation_N", to.nodeDeviation_N, from.node_deviation_n());
  each("node_valid", to.nodeValid, from.node_valid());
}

void fields(auto& to, const pb::Markers& from, auto&& each) {
  each("valid_markers", to.validMarkers, from.valid_markers());
  each("displacement_px", to.displacement_px, from.displacement_px());
  each("variance_px2", to.variance_px2, from.variance_px2());
  each("marker_valid", to.valid, from.marker_valid());
}

void fields(auto& to, const pb::Interval& from, auto&& each) {
  each("estimate", to.estimate, from.estimate());
  each("low", to.low, from.low());
  each("high", to.high, from.high());
}

void fields(auto& to, const pb::Slip& from, auto&& each) {
  each("state", to.state, from.state());
  each("stick_ratio", to.stickRatio, from.stick_ratio());
  each("friction", to.friction, from.friction());
  each("margin_N", to.margin_N, from.margin_n());
  each("holding_force_N", to.holdingForce_N, from.holding_force_n());
  each("model", to.model, from.model());
}

void fields(auto& to, const pb::TrackedContact& from, auto&& each) {
  each("id", to.id, from.id());
  each("phase", to.phase, from.phase());
  each("doubted", to.doubted, from.doubted());
  each("begun_ns", to.begun_ns, from.begun_ns());
  each("seen_ns", to.seen_ns, from.seen_ns());
  each("position_m", to.position_m, from.position_m());
  each("position_deviation_m", to.positionDeviation_m, from.position_deviation_m());
  each("radius_m", to.radius_m, from.radius_m());
  each("radius_deviation_m", to.radiusDeviation_m, from.radius_deviation_m());
  each("velocity_m_s", to.velocity_m_s, from.velocity_m_s());
  each("velocity_deviation_m_s", to.velocityDeviation_m_s, from.velocity_deviation_m_s());
  each("slip", to.slip, pointerIf(from.has_slip(), from.slip()));
  contactFields(to, from, each);
  each("angular_velocity_rad_s", to.angularVelocity_rad_s, from.angular_velocity_rad_s());
  each("angular_velocity_deviation_rad_s", to.angularVelocityDeviation_rad_s, from.angular_velocity_deviation_rad_s());
  each("end_cause", to.endCause, from.end_cause());
}

void fields(auto& to, const pb::CriticalPoint& from, auto&& each) {
  each("id", to.id, from.id());
  each("kind", to.kind, from.kind());
  each("index", to.index, from.index());
  each("begun_ns", to.begun_ns, from.begun_ns());
  each("position_m", to.position_m, from.position_m());
  each("position_deviation_m", to.positionDeviation_m, from.position_deviation_m());
  each("strength", to.strength, from.strength());
  each("angle_rad", to.angle_rad, from.angle_rad());
}

void fields(auto& to, const pb::Contacts& from, auto&& each) {
  each("run", to.run, from.run());
  each("valid", to.valid, from.valid());
  each("contacts", to.contacts, from.contacts());
  each("critical_points", to.criticalPoints, from.critical_points());
}

void fields(auto& to, const pb::Finger& from, auto&& each) {
  each("instance", to.instance, from.instance());
  each("link", to.link, from.link());
  each("state", to.state, from.state());
  each("sensor", to.sensor, from.sensor());
  each("frame_number", to.frameNumber, from.frame_number());
  each("captured_ns", to.captured_ns, from.captured_ns());
  each("captured_error_ns", to.capturedError_ns, from.captured_error_ns());
  each("captured_bound", to.capturedBound, from.captured_bound());
  wrenchFields(to, from, each);
}

void fields(auto& to, const pb::Grasp& from, auto&& each) {
  each("valid", to.valid, from.valid());
  wrenchFields(to, from, each);
  each("fingers", to.fingers, from.fingers());
}

void fields(auto& to, const pb::Gel& from, auto&& each) {
  each("youngs_modulus_Pa", to.youngsModulus_Pa, from.youngs_modulus_pa());
  each("poisson_ratio", to.poissonRatio, from.poisson_ratio());
  each("size_m", to.size_m, from.size_m());
}

/// Of a grid of nodes or a layer of markers.
void gridFields(auto& to, const auto& from, auto&& each) {
  each("columns", to.columns, from.columns());
  each("rows", to.rows, from.rows());
  each("pitch_m", to.pitch_m, from.pitch_m());
  each("centre_m", to.centre_m, from.centre_m());
}

void fields(auto& to, const pb::NodeGrid& from, auto&& each) {
  gridFields(to, from, each);
}

void fields(auto& to, const pb::MarkerLayer& from, auto&& each) {
  each("colour", to.colour, from.colour());
  each("contrast", Contrast{to.darker}, from.darker());
  gridFields(to.grid, from, each);
  each("depth_m", to.depth_m, from.depth_m());
  each("diameter_m", to.diameter_m, from.diameter_m());
}

void fields(auto& to, const pb::RefractingSurface& from, auto&& each) {
  each("centre_m", to.centre_m, from.centre_m());
  each("radii_m", to.radii_m, from.radii_m());
  each("index", to.index, from.index());
}

void fields(auto& to, const pb::Camera& from, auto&& each) {
  each("vendor", to.vendor, from.vendor());
  each("model", to.model, from.model());
  each("serial", to.serial, from.serial());
  each("pixel_format", to.pixelFormat, from.pixel_format());
  each("width_px", to.width_px, from.width_px());
  each("height_px", to.height_px, from.height_px());
  each("focal_px", to.focal_px, from.focal_px());
  each("aspect", to.aspect, from.aspect());
  each("principal_px", to.principal_px, from.principal_px());
  each("k1", to.k1, from.k1());
  each("k2", to.k2, from.k2());
  each("position_m", to.position_m, from.position_m());
  each("rotation_rad", to.rotation_rad, from.rotation_rad());
  each("gel_index", to.gelIndex, from.gel_index());
  each("window_index", to.windowIndex, from.window_index());
  each("window_thickness_m", to.windowThickness_m, from.window_thickness_m());
  each("surfaces", to.surfaces, from.surfaces());
  each("fisheye", to.fisheye, from.fisheye());
  each("k3", to.k3, from.k3());
  each("k4", to.k4, from.k4());
}

void fields(auto& to, const pb::Solver& from, auto&& each) {
  each("mechanics", to.mechanics, from.mechanics());
  each("regularisation", to.regularisation, from.regularisation());
  each("strength", to.strength, from.strength());
  each("contact_aware", to.contactAware, from.contact_aware());
  each("noise_px", to.noise_px, from.noise_px());
  each("force_scale_N", to.forceScale_N, from.force_scale_n());
  each("detection_limit_tangential_N", to.detectionLimitTangential_N, from.detection_limit_tangential_n());
  each("detection_limit_normal_N", to.detectionLimitNormal_N, from.detection_limit_normal_n());
}

/// What the answer to a request for a zero says of it, too.
void identityFields(auto& to, const pb::Zero& from, auto&& each) {
  each("id", to.id, from.id());
  each("time_ns", to.time_ns, from.time_ns());
  each("requested", to.requested, from.requested());
  each("requested_by", to.requestedBy, from.requested_by());
}

void fields(auto& to, const pb::Zero& from, auto&& each) {
  identityFields(to, from, each);
  each("rest_position_px", to.restPosition_px, from.rest_position_px());
  each("marker_present", to.markerPresent, from.marker_present());
}

void fields(auto& to, const pb::Body& from, auto&& each) {
  each("node_positions_m", to.nodePositions_m, from.node_positions_m());
  each("node_normals", to.nodeNormals, from.node_normals());
  each("node_areas_m2", to.nodeAreas_m2, from.node_areas_m2());
  each("marker_positions_m", to.markerPositions_m, from.marker_positions_m());
}

void fields(auto& to, const pb::Description& from, auto&& each) {
  each("software_version", to.softwareVersion, from.software_version());
  each("same_host", to.sameHost, from.host());
  each("topics", to.topics, from.topics());
  each("gel", Given{to.gel, to.hasGel()}, from.gel());
  each("layers", to.layers, from.layers());
  each("nodes", to.nodes, from.nodes());
  each("camera", to.camera, from.camera());
  each("solver", to.solver, from.solver());
  each("calibration_time_ns", to.calibration.time_ns, from.calibration().time_ns());
  each(nullptr, to.calibration.id, from.calibration().id());
  each("rest_pose", to.zero, pointerIf(from.has_zero(), from.zero()));
  each("body", to.body, pointerIf(from.has_body(), from.body()));
}

}  // namespace traction
