// Requests -> bytes of proto/traction/v1/control.proto, and bytes of replies -> what they hold.
#pragma once

#include "traction/control.h"

#include <string>
#include <string_view>

namespace traction {

enum class Request { kStatus, kDescription, kSnapshot };
std::string encodeRequest(Request request);

struct ZeroRequest {
  bool anyway = false;
  bool undo = false;
};
std::string encodeZero(const ZeroRequest& zero);
std::string encodeCalibration(const CalibrationStep& step);
std::string encodeCameraStep(const CameraStep& step);

// What the reply to a request holds. They throw Error kMalformed, kVersion, kRefused.
Status decodeStatusReply(std::string_view bytes);
Description decodeDescriptionReply(std::string_view bytes);
Snapshot decodeSnapshotReply(std::string_view bytes);
ZeroResult decodeZeroReply(std::string_view bytes);
CalibrationReport decodeCalibrationReply(std::string_view bytes);
CameraReport decodeCameraReply(std::string_view bytes);

}  // namespace traction
