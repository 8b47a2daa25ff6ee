// Requests about a camera's features <-> records: the part of the wire that knows them.
#pragma once

#include "daemon/records/camera_features.h"

#include <tl/expected.hpp>

#include <string>

namespace traction::v1 {
class CameraReply;
class CameraRequest;
}  // namespace traction::v1

namespace tractiond::publish {

/// From anybody: never trusted. The error is a sentence for the asker.
tl::expected<CameraStep, std::string> decodeCameraStep(const traction::v1::CameraRequest& request);

void encode(const CameraReport& from, traction::v1::CameraReply& to);

}  // namespace tractiond::publish
