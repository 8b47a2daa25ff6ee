// The once-a-second account of how the daemon does.
#pragma once

#include "daemon/records/camera.h"
#include "daemon/records/rest_drift.h"

#include <array>
#include <cstdint>

namespace tractiond::publish {

/// What the publisher does not know by itself.
struct Vitals {
  CameraVitals camera = {};
  std::array<std::uint64_t, 5> turns{};  ///< of the loops of capture, track, solve, publish, control
  RestDrift drift = {};
  double zeroWithin_s = 0.0;  ///< a zero that is asked for now is answered within this time; 0: not known
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
