#include "daemon/publish/wire_control.h"

#include "base/printable.h"
#include "daemon/publish/wire_parts.h"
#include "proto/traction/v1/endpoints.h"
#include "traction/v1/control.pb.h"

#include <google/protobuf/stubs/logging.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::publish {

namespace pb = traction::v1;

namespace {

constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kLargestPicture = 16U << 20U;  // of a snapshot [bytes]
constexpr std::size_t kLongestClient = 128;          // of a name for the log

/// Of a step that looks for a while; 0: as long as is usual.
bool isTime(double seconds) {
  constexpr double kLongest_s = 3600.0;
  return seconds >= 0.0 && seconds <= kLongest_s;  // and no NaN
}

tl::expected<CalibrationStep, std::string> decodeStep(const pb::CalibrateRequest& request) {
  using Kind = CalibrationStep::Kind;
  if (!isTime(request.noise().duration_s()) || !isTime(request.weight().patience_s()) ||
      !isTime(request.creep().duration_s()))
    return tl::unexpected<std::string>("a step of a calibration takes 0 (as long as is usual) to 3600 s");
  switch (request.step_case()) {
  case pb::CalibrateRequest::kGeometry:
    return CalibrationStep{.kind = Kind::kGeometry, .anyway = request.geometry().anyway()};
  case pb::CalibrateRequest::kNoise:
    return CalibrationStep{
        .kind = Kind::kNoise, .seconds = request.noise().duration_s(), .anyway = request.noise().anyway()};
  case pb::CalibrateRequest::kWeight: {
    const pb::CalibrateWeight& weight = request.weight();
    CalibrationStep step{
        .kind = Kind::kWeight, .seconds = weight.patience_s(), .weight_N = weight.weight_n(), .first = weight.first()};
    if (weight.has_direction()) {
      const pb::Vector3& along = weight.direction();
      step.direction = {along.x(), along.y(), along.z()};
      const double length2 = along.x() * along.x() + along.y() * along.y() + along.z() * along.z();
      if (!(length2 > 0.0) || !std::isfinite(length2)) {
        return tl::unexpected<std::string>("the direction of a weight has a length above 0");
      }
    }
    return step;
  }
  case pb::CalibrateRequest::kStiffness:
    return CalibrationStep{.kind = Kind::kStiffness};
  case pb::CalibrateRequest::kFinish:
    if (const std::string& name = request.finish().name(); name.empty() || traction::isValidName(name))
      return CalibrationStep{.kind = Kind::kFinish, .name = name};
    return tl::unexpected<std::string>("that is no name for a gel: 1 to 24 of A-Z, a-z, 0-9, _ and - are");
  case pb::CalibrateRequest::kCreep:
    return CalibrationStep{.kind = Kind::kCreep, .seconds = request.creep().duration_s()};
  case pb::CalibrateRequest::kRecovery:
    return CalibrationStep{.kind = Kind::kRecovery};
  case pb::CalibrateRequest::STEP_NOT_SET:
    break;
  }
  return tl::unexpected<std::string>("this step of a calibration is unknown to this version of tractiond");
}

tl::expected<Asked, std::string> decodeKind(const pb::Request& request) {
  switch (request.request_case()) {
  case pb::Request::kStatus:
    return Asked{.request = Request::kStatus};
  case pb::Request::kDescription:
    return Asked{.request = Request::kDescription};
  case pb::Request::kZero:
    return Asked{.request = Request::kZero, .zero = {.anyway = request.zero().anyway(), .undo = request.zero().undo()}};
  case pb::Request::kCalibrate:
    return decodeStep(request.calibrate()).map([](CalibrationStep step) {
      return Asked{.request = Request::kCalibrate, .calibration = std::move(step)};
    });
  case pb::Request::kSnapshot:
    return Asked{.request = Request::kSnapshot};
  case pb::Request::kCamera:
    if (request.camera().step_case() == CameraStep::STEP_NOT_SET)
      return tl::unexpected<std::string>("this request about the camera is unknown to this version of tractiond");
    return Asked{.request = Request::kCamera, .camera = request.camera()};
  case pb::Request::kAdopt:
    return Asked{.request = Request::kAdopt, .gelFile = request.adopt().gel_file()};
  case pb::Request::REQUEST_NOT_SET:
    break;
  }
  return tl::unexpected<std::string>("the request is empty or unknown to this version of tractiond");
}

std::string finish(pb::Reply& reply) {
  reply.set_version(kVersion);
  return reply.SerializeAsString();
}

}  // namespace

tl::expected<Asked, std::string> decodeRequest(std::string_view bytes) {
  // Else Protobuf writes a line on standard error for each string that is no UTF-8, and waits for its reader.
  [[maybe_unused]] static const auto before = google::protobuf::SetLogHandler(nullptr);
  pb::Request request;
  if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return tl::unexpected<std::string>("this is not a traction.v1.Request");
  }
  if (request.version() != kVersion) {
    return tl::unexpected("version " + std::to_string(request.version()) + " of the protocol is asked for, this is " +
                          std::to_string(kVersion));
  }
  auto asked = decodeKind(request);
  if (asked) asked->onBehalfOf = traction::printable(request.on_behalf_of().substr(0, kLongestClient));
  return asked;
}

std::string encodeReply(Request request, std::string_view message) {
  pb::Reply reply;
  google::protobuf::MessageLite& answer = request == Request::kStatus
                                              ? static_cast<google::protobuf::MessageLite&>(*reply.mutable_status())
                                              : *reply.mutable_description();
  if (!answer.ParseFromArray(message.data(), static_cast<int>(message.size()))) {
    return encodeErrorReply("the message that was sent last cannot be decoded");
  }
  return finish(reply);
}

std::string encodeZeroReply(const RestPose& zero, std::string_view remark) {
  pb::Reply reply;
  encode(zero, *reply.mutable_zero()->mutable_zero());
  reply.mutable_zero()->set_markers_present(static_cast<std::uint32_t>(std::ranges::count(zero.present, 1)));
  reply.mutable_zero()->set_markers_expected(static_cast<std::uint32_t>(zero.present.size()));
  reply.mutable_zero()->set_noise_levels(zero.noise);
  reply.mutable_zero()->set_remark(std::string(remark));
  return finish(reply);
}

std::string encodeCalibrationReply(const CalibrationReport& report) {
  pb::Reply reply;
  pb::CalibrateReply& all = *reply.mutable_calibrate();
  for (const CalibrationReport::Figure& from : report.figures) {
    pb::Figure& to = *all.add_figures();
    to.set_name(from.name);
    to.set_value(from.value);
    to.set_deviation(from.deviation);
  }
  for (const std::string& remark : report.remarks) all.add_remarks(remark);
  all.set_path(report.path);
  all.set_gel_file(report.gelFile);
  return finish(reply);
}

std::string encodeCameraReply(const CameraReport& report) {
  pb::Reply reply;
  *reply.mutable_camera() = report;
  return finish(reply);
}

std::string encodeAdoptReply() {
  pb::Reply reply;
  reply.mutable_adopt();
  return finish(reply);
}

std::string encodeSnapshotReply(const Snapshot& snapshot, const std::vector<sensor::MarkerLayer>& layers,
                                sensor::MeasuredWith with) {
  pb::Reply reply;
  pb::SnapshotReply& to = *reply.mutable_snapshot();
  PlainPicture picture = plainPicture(snapshot.frame);
  int reduced = 1;
  while (picture.levels.size() > kLargestPicture) reduce(snapshot.frame, reduced *= 2, picture);
  to.set_width(static_cast<std::uint32_t>(picture.width));
  to.set_height(static_cast<std::uint32_t>(picture.height));
  to.set_channels(static_cast<std::uint32_t>(picture.channels));
  to.set_levels(picture.levels.data(), picture.levels.size());
  to.set_reduced(static_cast<std::uint32_t>(reduced));
  if (reduced > 1) with.picture += ", reduced by " + std::to_string(reduced);
  to.set_measured_with(with.text());
  to.set_pixel_format(std::string(traitsOf(snapshot.frame.format).name));
  to.set_frame_number(snapshot.frame.info.frameNumber);
  to.set_received_real_ns(snapshot.frame.info.times.receivedReal_ns);
  to.mutable_place_px()->Add(snapshot.place_px.begin(), snapshot.place_px.end());
  for (const MarkerState state : snapshot.state) to.mutable_marker_state()->push_back(static_cast<char>(state));
  for (std::size_t i = 0; i < layers.size(); ++i) {
    to.mutable_marker_layer()->append(static_cast<std::size_t>(layers[i].count()), static_cast<char>(i));
    to.add_colours(wireColour(layers[i].colour));
  }
  to.mutable_spot_px()->Add(snapshot.spot_px.begin(), snapshot.spot_px.end());
  to.set_spot_layer(snapshot.spotLayer.data(), snapshot.spotLayer.size());
  return finish(reply);
}

std::string encodeErrorReply(std::string_view error) {
  pb::Reply reply;
  reply.set_error(std::string(error));
  return finish(reply);
}

}  // namespace tractiond::publish
