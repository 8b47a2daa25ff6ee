// Converts between records and the requests and replies of proto/traction/v1/control.proto. Reentrant.
#pragma once

#include "daemon/records/calibration.h"
#include "daemon/records/camera_features.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/snapshot.h"
#include "daemon/records/zero_request.h"
#include "sensor/measured_with.h"
#include "sensor/sensor.h"

#include <tl/expected.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace tractiond::publish {

enum class Request { kStatus, kDescription, kZero, kCalibrate, kCamera, kSnapshot, kAdopt };

/// A request with its parameters.
struct Asked {
  Request request = Request::kStatus;
  ZeroRequest zero = {};             ///< kZero, without `asker`
  CalibrationStep calibration = {};  ///< kCalibrate
  CameraStep camera = {};            ///< kCamera
  std::string gelFile = {};          ///< kAdopt: its text
  std::string onBehalfOf = {};       ///< client that a gateway names, printable; empty: the sender itself
};

/// Decodes an untrusted request. The error is a sentence for the client: the bytes are not a request, or the request is
/// of another version, of an unknown kind, or has a parameter out of range. From the first call on, Protobuf logs
/// nothing in this process.
tl::expected<Asked, std::string> decodeRequest(std::string_view bytes);

// These return the bytes of a reply.

/// \param request kStatus or kDescription
/// \param message the Status or Description as it was sent; bytes that cannot be decoded give a reply with an error, no
/// bytes an empty message
std::string encodeReply(Request request, std::string_view message);
/// \param remark why the zero may be wrong; empty: no reason is known
std::string encodeZeroReply(const RestPose& zero, std::string_view remark);
std::string encodeCalibrationReply(const CalibrationReport& report);
/// \param report its texts must be UTF-8
std::string encodeCameraReply(const CameraReport& report);
std::string encodeAdoptReply();
/// Halves the picture until it has at most 16 MiB; the places of markers stay those in the full one.
/// \param snapshot must fit (FrameCopy::fits)
/// \param layers layers of its markers; empty: there are none
/// \param with camera and full picture
std::string encodeSnapshotReply(const Snapshot& snapshot, const std::vector<sensor::MarkerLayer>& layers,
                                sensor::MeasuredWith with);
/// \param error sentence for the client
std::string encodeErrorReply(std::string_view error);

}  // namespace tractiond::publish
