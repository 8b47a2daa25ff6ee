// Converts between records and the requests and replies about a camera's features.
#pragma once

#include "daemon/records/camera_features.h"

#include <tl/expected.hpp>

#include <string>

namespace traction::v1 {
class CameraReply;
class CameraRequest;
}  // namespace traction::v1

namespace tractiond::publish {

/// Decodes an untrusted request. The error is a sentence for the client.
tl::expected<CameraStep, std::string> decodeCameraStep(const traction::v1::CameraRequest& request);

/// Encodes the camera's answer.
void encode(const CameraReport& from, traction::v1::CameraReply& to);

}  // namespace tractiond::publish
