// The once-a-second account of how the daemon does.
#pragma once

#include "base/fixed_text.h"
#include "daemon/records/camera.h"
#include "daemon/records/gel_report.h"
#include "daemon/records/rest_drift.h"
#include "sensor/gel.h"

#include <array>
#include <cstdint>

namespace tractiond::publish {

/// How many markers are found, and whether they are those of the gel file.
struct MarkerStatus {
  struct Layer {
    sensor::Colour colour = sensor::Colour::kBlue;
    int expected = 0, found = 0, inZero = 0;
    LatticeSeen seen;
  };
  struct Finding {
    FixedText<32> name;
    double expected = 0.0, seen = 0.0, deviation = 0.0;
    bool contradicts = false;
  };
  std::array<Layer, 2> layers{};
  int layerCount = 0;
  FixedText<1500> remark;
  std::array<Finding, 24> findings{};
  int findingCount = 0;
};

/// How the kernel runs the threads that a frame passes, as it says now.
struct SchedulingStatus {
  struct Thread {
    FixedText<15> name;
    int priority = 0;  ///< among real-time threads; 0: it is none
    FixedText<120> cpus;
  };
  int askedPriority = 0;  ///< 0: none
  FixedText<120> askedCpus;
  bool askedLock = false;
  std::array<Thread, 12> threads{};
  int threadCount = 0;
  std::uint64_t locked_bytes = 0;
};

/// What the publisher does not know by itself.
struct Vitals {
  CameraVitals camera = {};
  std::array<std::uint64_t, 5> turns{};  ///< of the loops of capture, track, solve, publish, control
  RestDrift drift = {};
  MarkerStatus markers = {};
  double zeroWithin_s = 0.0;          ///< a zero that is asked for now is answered within this time; 0: not known
  FixedText<300> invalidWhy = {};     ///< of the fields since the last status; empty: all were valid
  FixedText<200> unreleasedWhy = {};  ///< why the camera would stay locked after a kill -9; empty: it would not
  std::uint64_t logLinesLost = 0;
  std::uint64_t memory_bytes = 0;  ///< that the process holds
  SchedulingStatus scheduling = {};
};

/// All durations since the start.
struct Histogram {
  static constexpr std::array kBounds_s = {1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0};

  std::array<std::uint64_t, kBounds_s.size() + 1>
      counts{};  ///< above the bound before, at most their own; the last: above all
  double sum_s = 0.0;
};

/// Of one interval, beside all before.
struct Quantiles {
  double p50_s = 0.0;
  double p99_s = 0.0;
  double max_s = 0.0;
  Histogram sinceStart = {};
};

struct Status {
  Vitals vitals;
  double uptime_s = 0.0;
  double received_hz = 0.0;
  double published_hz = 0.0;
  double residual_px = 0.0;             ///< of the fields since the last status, root mean square
  Quantiles track, solve, send, total;  ///< received -> tracked -> solved -> sent, and all of it
};

}  // namespace tractiond::publish
