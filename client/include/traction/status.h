// The daemon's state, published once a second whether or not frames arrive.
#pragma once

#include "traction/description.h"

#include <optional>

namespace traction {

enum class CameraState {
  kUnknown,     ///< not opened yet
  kWaiting,     ///< not found yet; the daemon searches for it
  kStreaming,   ///< open and streaming
  kLost,        ///< was connected and is gone; the daemon searches for it
  kConnecting,  ///< found; the daemon sets it up
};

/// State of the link to the camera. Packets are counted from the daemon's start; of a link that broke, the packets of
/// its last second may be missing.
struct CameraLink {
  std::uint64_t packetsResent = 0;   ///< resend requests that were answered
  std::uint64_t packetsMissing = 0;  ///< packets that never arrived
  /// Packets kept from the stream and control channels: from another sender, or no room.
  std::uint64_t packetsRefused = 0;
  std::string ptp;                    ///< PTP state in the camera's own word; empty: none
  std::optional<double> ptpOffset_s;  ///< camera's clock minus its master's, as the camera reports it
  std::optional<double> temperature_C;
};

/// Accounts for every frame since the daemon's start: received = published + inFlight + losses(). Unit: frames.
struct Ledger {
  std::uint64_t received = 0;  ///< delivered by the camera driver, intact or not
  std::uint64_t published = 0;
  std::uint64_t inFlight = 0;

  std::uint64_t incomplete = 0;   ///< packets are missing, or the transfer was aborted
  std::uint64_t wrongSize = 0;    ///< payload or picture size differs from the configured one
  std::uint64_t wrongFormat = 0;  ///< pixel format differs from the configured one
  std::uint64_t stale = 0;        ///< an old picture was delivered again
  /// Frame id or time jumped ahead, and fewer than three consecutive frames agree with it.
  std::uint64_t implausible = 0;
  std::uint64_t evictedBeforeTrack = 0;  ///< replaced by a newer frame while waiting for the tracker
  std::uint64_t noRestPose = 0;          ///< used to label the markers and to take the zero
  std::uint64_t noGel = 0;               ///< intact, but not measured: the daemon has no gel file
  std::uint64_t evictedBeforeSolve = 0;
  std::uint64_t evictedBeforePublish = 0;
  std::uint64_t discardedAtStop = 0;

  std::uint64_t missing = 0;     ///< never arrived, by gaps in the camera's frame ids; not part of the sum
  std::uint64_t reconnects = 0;  ///< number of times that the camera was lost and opened again
  std::uint64_t doubted = 0;     ///< new frames with kDoubtedOrigin; not part of the sum
  std::uint64_t invalid = 0;     ///< published fields that are not valid; not part of the sum

  /// Returns the number of received frames that were neither published nor are in flight.
  std::uint64_t losses() const {
    return incomplete + wrongSize + wrongFormat + stale + implausible + evictedBeforeTrack + noRestPose + noGel +
           evictedBeforeSolve + evictedBeforePublish + discardedAtStop;
  }
};

/// Distribution of all durations since the daemon's start.
struct Histogram {
  /// Upper bounds of the bins, ascending.
  std::vector<double> bounds_s;
  /// Per bin (bound before, own bound]; one more for durations above the last bound.
  std::vector<std::uint64_t> counts;
  double sum_s = 0.0;
};

/// Quantiles of the durations since the status before; 0: there was none.
struct Quantiles {
  double p50_s = 0.0;
  double p99_s = 0.0;
  double max_s = 0.0;
  Histogram sinceStart;
};

/// Motion of the unloaded picture since the zero, averaged over some seconds of frames in which nothing touched the
/// gel. Scale and roll are about the principal point.
struct RestDrift {
  double shiftU_px = 0.0;  ///< to the right
  double shiftV_px = 0.0;  ///< down
  double scale = 0.0;      ///< relative change of size
  double roll = 0.0;       ///< [rad], from u towards v
  double rms_px = 0.0;     ///< root mean square of the markers' coordinates after that motion is removed
  double age_s = 0.0;      ///< since the last frame in which nothing touched the gel
};

/// Number of markers found, and whether they agree with the gel file.
struct MarkerStatus {
  struct Layer {
    Colour colour = Colour::kUnknown;
    std::uint32_t expected = 0;  ///< number in the gel file
    std::uint32_t found = 0;     ///< number in the newest frame
    std::uint32_t inZero = 0;    ///< number in the zero in force; 0: there is no zero
    std::uint32_t columns = 0;   ///< columns in the picture at the last labelling; 0: never labelled
    std::uint32_t rows = 0;
  };
  /// Compares one number of the gel file with the rest picture.
  struct Finding {
    std::string name;  ///< ends with its unit: "pitch_mm"
    double expected = 0.0;
    double seen = 0.0;
    double deviation = 0.0;    ///< standard deviation of seen - expected; 0: an exact count
    bool contradicts = false;  ///< true: fields carry kGelMismatch
  };
  std::vector<Layer> layers;
  std::string remark;  ///< why markers are missing, or what contradicts the gel file; empty: nothing is wrong
  std::vector<Finding> findings;

  /// Returns whether the daemon runs without a gel file, and therefore publishes no field.
  bool isWithoutGel() const { return layers.empty() && !remark.empty(); }
};

/// Scheduling and memory locking of the frame path's threads, as configured and as the kernel reports them.
struct Scheduling {
  struct Thread {
    std::string name;            ///< as in /proc/PID/task/TID/comm
    std::uint32_t priority = 0;  ///< real-time priority, 1 to 99; 0: not a real-time thread
    std::string cpus;            ///< processors that it may run on: "0-2,5"
  };
  std::uint32_t askedPriority = 0;  ///< configured priority; 0: none
  std::string askedCpus;            ///< configured processors; empty: any
  bool askedLock = false;
  std::vector<Thread> threads;
  std::uint64_t locked_bytes = 0;  ///< address space that stays in memory once touched
};

struct Status {
  Header header;
  double uptime_s = 0.0;
  CameraState camera = CameraState::kUnknown;
  std::string cameraWhy;  ///< why the camera does not stream; empty: it streams, or the reason is not known
  std::optional<CameraLink> cameraLink;  ///< empty: the camera was not opened yet
  Ledger ledger;

  // The following figures cover the time since the status before.
  double received_hz = 0.0;
  double published_hz = 0.0;
  double residual_px = 0.0;  ///< root mean square of Field::residual_px
  Quantiles track;           ///< from the frame's arrival from the driver until its markers are located
  Quantiles solve;           ///< until its forces are computed
  Quantiles send;            ///< until the message is handed to ZeroMQ
  Quantiles total;           ///< from the frame's arrival from the driver until the message is handed to ZeroMQ

  /// Turns of the loops of capture, track, solve, publish and control since the start. A number that stands still shows
  /// a hung loop.
  std::array<std::uint64_t, 5> turns{};

  MarkerStatus markers;
  std::optional<RestDrift> restDrift;  ///< empty: no unloaded frame since the zero or the start

  double zeroWithin_s = 0.0;       ///< longest time until a zero requested now is answered; 0: not known
  std::uint64_t logLinesLost = 0;  ///< lines of the daemon's log lost because its reader was too slow or its disk full
  std::uint64_t memory_bytes = 0;  ///< resident memory of the daemon; 0: not known
  /// Why fields since the status before are not valid, with the configuration key that decides; empty: all are valid.
  std::string invalidWhy;
  /// Why the camera would stay locked for its heartbeat time (usually 3 s) after a kill -9 of the daemon; empty: it
  /// would not.
  std::string unreleasedWhy;
  Scheduling scheduling;
};

}  // namespace traction
