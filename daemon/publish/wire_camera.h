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

/// Decodes an untrusted request. The error is a sentence for the client: the request is of an unknown kind, or a name,
/// value or list in it is malformed or too long. Reentrant.
tl::expected<CameraStep, std::string> decodeCameraStep(const traction::v1::CameraRequest& request);

/// Encodes the camera's answer into an empty message. Its texts must be UTF-8. Limits that are not finite are left out.
/// Reentrant.
void encode(const CameraReport& from, traction::v1::CameraReply& to);

}  // namespace tractiond::publish
