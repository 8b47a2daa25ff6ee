// What becomes of a buffer that was popped: judged by the frame gate, counted in the ledger, dated, made a frame.
#pragma once

#include "daemon/capture/camera_info.h"
#include "daemon/capture/device_clock.h"
#include "daemon/capture/driver.h"
#include "daemon/capture/frame_gate.h"
#include "daemon/records/frame.h"
#include "daemon/records/ledger.h"

#include <optional>

namespace tractiond::capture {

/// Thread-bound. judge() allocates nothing.
class Intake {
 public:
  /// The ledger outlives this.
  explicit Intake(Ledger& ledger)
      : ledger_(ledger) {}

  /// Begins a session of the camera. \param buffers of the driver: the gate remembers more pictures than that
  void begin(const CameraInfo& info, int buffers);

  /// Judges and counts a buffer of the session. Fills the frame where the verdict is kNew.
  Judgement judge(const Buffer& buffer, Driver& driver, Frame& frame);

 private:
  Ledger& ledger_;
  std::optional<FrameGate> gate_;
  CaptureClock clock_;
  ClockFit asked_;  ///< room for the driver's
  unsigned session_ = 0;
};

}  // namespace tractiond::capture
