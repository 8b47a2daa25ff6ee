// Requests and replies of proto/traction/v1/control.proto <-> records.
#pragma once

#include "daemon/records/calibration.h"
#include "daemon/records/camera_features.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/snapshot.h"
#include "daemon/records/zero_request.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace tractiond::publish {

enum class Request { kStatus, kDescription, kZero, kCalibrate, kCamera, kSnapshot };

/// A request with what it says.
struct Asked {
  Request request = Request::kStatus;
  ZeroRequest zero = {};             ///< kZero, without its asker
  CalibrationStep calibration = {};  ///< kCalibrate
  CameraStep camera = {};            ///< kCamera
  std::string onBehalfOf = {};       ///< whom a gateway names as the asker, printable; empty: whoever sends it
};

/// From anybody: never trusted. The error is a sentence for the asker.
tl::expected<Asked, std::string> decodeRequest(std::string_view bytes);

/// `message` is a Status or Description as it was sent, answering `request`.
std::string encodeReply(Request request, std::string_view message);
/// `remark`: why it may be wrong; empty: no reason is known.
std::string encodeZeroReply(const RestPose& zero, std::string_view remark);
std::string encodeCalibrationReply(const CalibrationReport& report);
std::string encodeCameraReply(const CameraReport& report);
/// Reduced until it has at most 16 MiB. \param layers of its markers
std::string encodeSnapshotReply(const Snapshot& snapshot, const std::vector<sensor::MarkerLayer>& layers);
std::string encodeErrorReply(std::string_view error);

}  // namespace tractiond::publish
