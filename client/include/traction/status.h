// How the daemon does: published once a second, with or without frames.
#pragma once

#include "traction/description.h"

#include <optional>

namespace traction {

enum class CameraState {
  kUnknown,     ///< not opened yet
  kWaiting,     ///< not there yet; being looked for
  kStreaming,   ///< open
  kLost,        ///< was there and is gone; being looked for
  kConnecting,  ///< found; being set up
};

/// Of the link to the camera; packets since the daemon was started, but those of the last second before a link broke.
struct CameraLink {
  std::uint64_t packetsResent = 0;    ///< asked for again, and come
  std::uint64_t packetsMissing = 0;   ///< never come
  std::uint64_t packetsRefused = 0;   ///< kept from stream and control channel: not the camera's, or no room for them
  std::string ptp;                    ///< the camera's word for its PTP state; empty: it has none
  std::optional<double> ptpOffset_s;  ///< of the camera's clock from its master's, as the camera says
  std::optional<double> temperature_C;
};

/// The account of every frame since the start of the daemon, in frames: received = published + inFlight + losses().
struct Ledger {
  std::uint64_t received = 0;  ///< handed over by the camera driver, good or bad
  std::uint64_t published = 0;
  std::uint64_t inFlight = 0;

  std::uint64_t incomplete = 0;          ///< packets missing, aborted ...
  std::uint64_t wrongSize = 0;           ///< payload or picture size is not what was agreed
  std::uint64_t wrongFormat = 0;         ///< pixel format is not what was agreed
  std::uint64_t stale = 0;               ///< an old picture handed out again
  std::uint64_t implausible = 0;         ///< id or time jumped ahead; held back until three frames in a row agree
  std::uint64_t evictedBeforeTrack = 0;  ///< newer frames came before tracking had time for this one
  std::uint64_t noRestPose = 0;          ///< used to find the markers and to take the zero
  std::uint64_t noGel = 0;               ///< could be looked at, and nothing was measured: the daemon has no gel file
  std::uint64_t evictedBeforeSolve = 0;
  std::uint64_t evictedBeforePublish = 0;
  std::uint64_t discardedAtStop = 0;

  std::uint64_t missing = 0;     ///< never arrived, by gaps in the camera's ids; not part of the sum
  std::uint64_t reconnects = 0;  ///< how often the camera was lost and opened again
  std::uint64_t doubted = 0;     ///< new frames that may not be the camera's own
  std::uint64_t invalid = 0;     ///< of the published: fields that are not valid

  std::uint64_t losses() const {
    return incomplete + wrongSize + wrongFormat + stale + implausible + evictedBeforeTrack + noRestPose + noGel +
           evictedBeforeSolve + evictedBeforePublish + discardedAtStop;
  }
};

/// All durations since the start of the daemon.
struct Histogram {
  std::vector<double> bounds_s;
  std::vector<std::uint64_t> counts;  ///< each above the bound before and at most its own; one more: above the last
  double sum_s = 0.0;
};

struct Quantiles {
  double p50_s = 0.0;
  double p99_s = 0.0;
  double max_s = 0.0;
  Histogram sinceStart;
};

/// How far the untouched picture has come from the zero; scale and roll about the principal point.
struct RestDrift {
  double shiftU_px = 0.0;  ///< right
  double shiftV_px = 0.0;  ///< down
  double scale = 0.0;      ///< relative
  double roll = 0.0;       ///< [rad], u towards v
  double rms_px = 0.0;     ///< of the markers' coordinates besides that
  double age_s = 0.0;      ///< since the last frame in which nothing touched
};

/// How many markers are found, and whether they are those of the gel file.
struct MarkerStatus {
  struct Layer {
    Colour colour = Colour::kUnknown;
    std::uint32_t expected = 0;  ///< of the gel file
    std::uint32_t found = 0;     ///< in the newest frame
    std::uint32_t inZero = 0;    ///< in the zero in force; 0: there is none
    std::uint32_t columns = 0;   ///< that the picture showed when the markers were labelled last; 0: never
    std::uint32_t rows = 0;
  };
  /// A number of the gel file, and what the rest picture shows instead.
  struct Finding {
    std::string name;  ///< with its unit: "pitch_mm"
    double expected = 0.0;
    double seen = 0.0;
    double deviation = 0.0;    ///< standard, of their difference; 0: a number that is counted
    bool contradicts = false;  ///< fields carry kGelMismatch
  };
  std::vector<Layer> layers;
  std::string remark;  ///< for people: why markers are missing, what contradicts the gel file; empty: all is well
  std::vector<Finding> findings;

  /// The daemon has no gel file, and the remark says so: no field can come.
  bool isWithoutGel() const { return layers.empty() && !remark.empty(); }
};

/// How the kernel runs the threads that a frame passes, and what it keeps in memory: asked, and as it is.
struct Scheduling {
  struct Thread {
    std::string name;            ///< as in /proc/PID/task/TID/comm
    std::uint32_t priority = 0;  ///< among real-time threads, 1 to 99; 0: it is none
    std::string cpus;            ///< that it may run on, "0-2,5"
  };
  std::uint32_t askedPriority = 0;  ///< 0: none
  std::string askedCpus;            ///< empty: any
  bool askedLock = false;
  std::vector<Thread> threads;
  std::uint64_t locked_bytes = 0;  ///< of the address space, that stay in memory once touched
};

struct Status {
  Header header;
  double uptime_s = 0.0;
  CameraState camera = CameraState::kUnknown;
  std::string cameraWhy;                 ///< why it does not stream; empty: it does, or nobody knows
  std::optional<CameraLink> cameraLink;  ///< none: not opened yet
  Ledger ledger;

  // Since the status before.
  double received_hz = 0.0;
  double published_hz = 0.0;
  double residual_px = 0.0;  ///< Field::residual_px, root mean square
  Quantiles track;           ///< frame popped from the driver -> markers found
  Quantiles solve;           ///< -> forces known
  Quantiles send;            ///< -> handed to be sent
  Quantiles total;           ///< frame popped from the driver -> handed to be sent

  /// Turns of the loops of capture, track, solve, publish and control since the start: one that stands still hangs.
  std::array<std::uint64_t, 5> turns{};

  MarkerStatus markers;
  std::optional<RestDrift> restDrift;  ///< none: nothing has been seen untouched since the zero or the start

  double zeroWithin_s = 0.0;       ///< a zero that is asked for now is answered within this time; 0: not known
  std::uint64_t logLinesLost = 0;  ///< of the daemon's log, whose reader was too slow or whose disk was full
  std::uint64_t memory_bytes = 0;  ///< that the daemon holds; 0: not known
  /// Why fields since the status before are not valid, with the key that decides; empty: none is.
  std::string invalidWhy;
  /// Why the camera would stay locked for its heartbeat's time (3 s for most) after a kill -9 of the daemon; empty: it
  /// would not.
  std::string unreleasedWhy;
  Scheduling scheduling;
};

}  // namespace traction
