// The once-a-second account of how the daemon does.
#pragma once

#include "daemon/records/rest_drift.h"

#include <array>
#include <cstdint>

namespace tractiond::publish {

enum class CameraState : std::uint8_t {
  kUnknown,    ///< not opened yet
  kWaiting,    ///< not there yet; being looked for
  kStreaming,  ///< open
  kLost,       ///< was there and is gone; being looked for
};

/// What the publisher does not know by itself.
struct Vitals {
  CameraState camera = CameraState::kUnknown;
  std::array<std::uint64_t, 5> turns{};  ///< of the loops of capture, track, solve, publish, control
  RestDrift drift = {};
};

struct Quantiles {
  double p50_s = 0.0;
  double p99_s = 0.0;
  double max_s = 0.0;
};

struct Status {
  Vitals vitals;
  double uptime_s = 0.0;
  double received_hz = 0.0;
  double published_hz = 0.0;
  Quantiles track, solve, send, total;  ///< received -> tracked -> solved -> sent, and all of it
};

}  // namespace tractiond::publish
