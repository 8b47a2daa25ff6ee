// State of the camera and of the link to it, for the status.
#pragma once

#include "base/fixed_text.h"
#include "traction/v1/status.pb.h"

#include <cstdint>

namespace tractiond {

/// The values are those of the messages.
enum class CameraState : std::uint8_t {
  kUnknown = traction::v1::CAMERA_STATE_UNKNOWN,        ///< not searched for yet
  kWaiting = traction::v1::CAMERA_STATE_WAITING,        ///< not found yet; it is searched for
  kStreaming = traction::v1::CAMERA_STATE_STREAMING,    ///< open
  kLost = traction::v1::CAMERA_STATE_LOST,              ///< was connected and is gone; it is searched for
  kConnecting = traction::v1::CAMERA_STATE_CONNECTING,  ///< found; it is being set up
};

/// A line of text for the operator, cut to 200 bytes between two characters of UTF-8. Does not check the text.
using Line = FixedText<200>;

/// Its texts must be valid UTF-8, which Line does not ensure. Text of a camera must be passed through Line, which
/// bounds its length.
using CameraLink = traction::v1::CameraLink;

struct CameraVitals {
  CameraState state = CameraState::kUnknown;
  Line why;  ///< why the camera does not stream, or what it waits for; empty: not known, or nothing
  CameraLink link;
};

}  // namespace tractiond
