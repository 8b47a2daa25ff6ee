#include "client/src/decode_control.h"

#include "client/src/messages.h"
#include "proto/traction/v1/vectors.h"

#include <algorithm>
#include <string>

namespace traction {

namespace {

static_assert(static_cast<int>(CameraFeature::Kind::kRegister) == pb::CameraFeatureKind_MAX);
static_assert(static_cast<int>(CameraFeature::Access::kReadWrite) == pb::CameraFeatureAccess_MAX);

CameraFeature featureOf(const pb::CameraFeature& from) {
  CameraFeature feature;
  feature.name = from.name();
  feature.value = from.value();
  feature.unit = from.unit();
  feature.kind = enumOf(from.kind(), CameraFeature::Kind::kRegister);
  feature.access = enumOf(from.access(), CameraFeature::Access::kReadWrite);
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

/// Returns kAbsent for a state of a later daemon.
Snapshot::MarkerState markerStateOf(char byte) {
  return static_cast<Snapshot::MarkerState>(std::min<unsigned char>(static_cast<unsigned char>(byte), 3));
}

}  // namespace

pb::Reply replyOf(std::string_view bytes, pb::Reply::ReplyCase expected) {
  auto reply = parse<pb::Reply>(bytes);
  if (reply.version() != kControlVersion) {
    throw Error(ErrorCode::kVersion, "the daemon speaks version " + std::to_string(reply.version()) +
                                         " of the protocol, this library " + std::to_string(kControlVersion));
  }
  if (!reply.error().empty()) throw Error(ErrorCode::kRefused, reply.error());
  require(reply.reply_case() == expected, "the reply does not answer the request");
  return reply;
}

pb::CalibrateRequest requestOf(const CalibrationStep& step) {
  pb::CalibrateRequest request;
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
    if (step.direction != std::array<double, 3>{})
      setVector(step.direction, *request.mutable_weight()->mutable_direction());
    break;
  case CalibrationStep::Kind::kStiffness:
    request.mutable_stiffness();
    break;
  case CalibrationStep::Kind::kFinish:
    request.mutable_finish()->set_name(step.name);
    break;
  case CalibrationStep::Kind::kCreep:
    request.mutable_creep()->set_duration_s(step.seconds);
    break;
  case CalibrationStep::Kind::kRecovery:
    request.mutable_recovery();
    break;
  }
  return request;
}

pb::CameraRequest requestOf(const CameraStep& step) {
  pb::CameraRequest request;
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
  return request;
}

ZeroResult resultOf(const pb::ZeroReply& from) {
  return {zeroOf(from.zero()), from.markers_present(), from.markers_expected(), from.noise_levels(), from.remark()};
}

Snapshot snapshotOf(const pb::SnapshotReply& from) {
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
  snapshot.measuredWith = from.measured_with();
  snapshot.frameNumber = from.frame_number();
  snapshot.receivedReal_ns = from.received_real_ns();
  const auto colourAt = [&from](char layer) {
    const int index = static_cast<unsigned char>(layer);
    return index < from.colours_size() ? enumOf(from.colours(index), Colour::kGrey) : Colour::kUnknown;
  };
  const auto placeOf = [](const auto& places, std::size_t i) {
    return std::array<float, 2>{places[static_cast<int>(2 * i)], places[static_cast<int>(2 * i + 1)]};
  };
  const std::size_t markers = from.marker_state().size(), spots = from.spot_layer().size();
  require(from.marker_layer().size() == markers && static_cast<std::size_t>(from.place_px_size()) == 2 * markers &&
              static_cast<std::size_t>(from.spot_px_size()) == 2 * spots,
          "the picture's arrays have different sizes");
  for (std::size_t i = 0; i < markers; ++i) {
    snapshot.markers.push_back(
        {placeOf(from.place_px(), i), colourAt(from.marker_layer()[i]), markerStateOf(from.marker_state()[i])});
  }
  for (std::size_t i = 0; i < spots; ++i) {
    snapshot.spots.push_back({placeOf(from.spot_px(), i), colourAt(from.spot_layer()[i])});
  }
  return snapshot;
}

CalibrationReport reportOf(const pb::CalibrateReply& from) {
  CalibrationReport report;
  for (const pb::Figure& figure : from.figures()) {
    report.figures.push_back({figure.name(), figure.value(), figure.deviation()});
  }
  report.remarks.assign(from.remarks().begin(), from.remarks().end());
  report.path = from.path();
  report.gelFile = from.gel_file();
  return report;
}

CameraReport reportOf(const pb::CameraReply& from) {
  CameraReport report;
  for (const pb::CameraFeature& feature : from.features()) report.features.push_back(featureOf(feature));
  report.remarks.assign(from.remarks().begin(), from.remarks().end());
  report.camera = from.camera();
  return report;
}

}  // namespace traction
