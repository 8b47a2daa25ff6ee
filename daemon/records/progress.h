// How far each stage has come and how the camera is: for the status message and the watchdog.
#pragma once

#include "daemon/records/ledger.h"

namespace tractiond {

enum class CameraState : std::uint8_t {
  kUnknown,    ///< not opened yet
  kWaiting,    ///< not there yet; being looked for
  kStreaming,  ///< open
  kLost,       ///< was there and is gone; being looked for
};

/// Frames that went through each stage, whatever came of them. Each counter is written by its stage's thread, `camera`
/// by the capture thread; read by any.
struct Progress {
  Counter captured;
  Counter tracked;
  Counter solved;
  Counter published;
  std::atomic<CameraState> camera{CameraState::kUnknown};
};

}  // namespace tractiond
