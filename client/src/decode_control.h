// Encodes requests to the control endpoint and decodes its replies (proto/traction/v1/control.proto).
#pragma once

#include "traction/control.h"

#include <string>
#include <string_view>

namespace traction {

// The functions encode...() return a traction.v1.Request as Protobuf bytes. They check no values, and leave out
// those that the kind of a step does not use. All functions of this file are reentrant.

/// The requests without options.
enum class Request { kStatus, kDescription, kSnapshot };
std::string encodeRequest(Request request);

/// The options of a request for a zero.
struct ZeroRequest {
  bool anyway = false;  ///< see ZeroOptions
  bool undo = false;    ///< true: restores the previous zero
};

std::string encodeZero(const ZeroRequest& zero);
std::string encodeCalibration(const CalibrationStep& step);
std::string encodeCameraStep(const CameraStep& step);
std::string encodeAdopt(const std::string& gelFile);

// Decode the Protobuf bytes of a reply to the request of the same name; the bytes need not outlive the call. They check
// shapes, not that numbers are finite, except those of a description (decode.h) and a zero. They throw Error
// kMalformed, also for a reply to another request, kVersion, and kRefused with the daemon's reason.
Status decodeStatusReply(std::string_view bytes);
Description decodeDescriptionReply(std::string_view bytes);
Snapshot decodeSnapshotReply(std::string_view bytes);
ZeroResult decodeZeroReply(std::string_view bytes);
CalibrationReport decodeCalibrationReply(std::string_view bytes);
CameraReport decodeCameraReply(std::string_view bytes);
void decodeAdoptReply(std::string_view bytes);

}  // namespace traction
