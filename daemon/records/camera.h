// State of the camera and of the link to it, for the status.
#pragma once

#include "traction/v1/status.pb.h"

#include <cstdint>
#include <string>

namespace tractiond {

/// The values are those of the messages.
enum class CameraState : std::uint8_t {
  kUnknown = traction::v1::CAMERA_STATE_UNKNOWN,        ///< not searched for yet
  kWaiting = traction::v1::CAMERA_STATE_WAITING,        ///< not found yet; it is searched for
  kStreaming = traction::v1::CAMERA_STATE_STREAMING,    ///< open
  kLost = traction::v1::CAMERA_STATE_LOST,              ///< was connected and is gone; it is searched for
  kConnecting = traction::v1::CAMERA_STATE_CONNECTING,  ///< found; it is being set up
};

/// Its texts must be valid UTF-8.
using CameraLink = traction::v1::CameraLink;

struct CameraVitals {
  CameraState state = CameraState::kUnknown;
  std::string why;       ///< why the camera does not stream, or what it waits for; empty: not known, or nothing
  bool repeats = false;  ///< it streams, and sends one picture again and again, as `why` says
  CameraLink link;
};

}  // namespace tractiond
