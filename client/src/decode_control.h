// Requests to the control endpoint, and its replies (proto/traction/v1/control.proto).
#pragma once

#include "traction/control.h"
#include "traction/v1/control.pb.h"

#include <cstdint>
#include <string_view>

namespace traction {

namespace pb = traction::v1;

inline constexpr std::uint32_t kControlVersion = 1;

// All functions of this file are reentrant.

/// Returns the part of a request for a step. Checks no values, and leaves out those that its kind does not use.
pb::CalibrateRequest requestOf(const CalibrationStep& step);
pb::CameraRequest requestOf(const CameraStep& step);

/// Parses a reply and checks that it answers `expected`.
/// \throws Error kMalformed, kVersion, and kRefused with the daemon's reason
pb::Reply replyOf(std::string_view bytes, pb::Reply::ReplyCase expected);

// Convert replies. They check shapes, not that numbers are finite, except those of a zero. \throws Error kMalformed
Snapshot snapshotOf(const pb::SnapshotReply& from);
ZeroResult resultOf(const pb::ZeroReply& from);
CalibrationReport reportOf(const pb::CalibrateReply& from);
CameraReport reportOf(const pb::CameraReply& from);

}  // namespace traction
