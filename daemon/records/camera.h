// How a camera does, for the status.
#pragma once

#include "base/fixed_text.h"

#include <cstdint>

namespace tractiond {

/// The numbers of the wire.
enum class CameraState : std::uint8_t {
  kUnknown,     ///< not looked for yet
  kWaiting,     ///< not there yet; being looked for
  kStreaming,   ///< open
  kLost,        ///< was there and is gone; being looked for
  kConnecting,  ///< found; being set up
};

/// A line of text for people.
using Line = FixedText<200>;

/// How the link to the camera does; packets since the start, but those of the last second before a link broke.
struct CameraLink {
  std::uint64_t packetsResent = 0;   ///< asked for again, and come
  std::uint64_t packetsMissing = 0;  ///< never come
  std::uint64_t packetsRefused = 0;  ///< kept from stream and control channel: not its, or no room for them
  Line ptp;                          ///< the camera's word for its state; empty: no PTP
  double ptpOffset_s = 0.0;          ///< of the camera's clock from its master's, as it says
  double temperature_C = 0.0;        ///< of the camera
  bool hasPtpOffset = false, hasTemperature = false;
};

struct CameraVitals {
  CameraState state = CameraState::kUnknown;
  Line why;  ///< it is not streaming; empty: it is, or nobody knows
  CameraLink link;
};

}  // namespace tractiond
