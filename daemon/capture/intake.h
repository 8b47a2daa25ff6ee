// Makes frames of popped buffers: the frame gate judges each, the ledger counts it, and a new one is dated.
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
  /// The ledger must outlive this.
  explicit Intake(Ledger& ledger)
      : ledger_(ledger) {}

  /// Begins a session of the camera. \param buffers number of the driver's buffers: the gate remembers more pictures
  void begin(const CameraInfo& info, int buffers);

  /// Judges and counts a buffer of the session. Fills in the frame if the verdict is kNew.
  Judgement judge(const Buffer& buffer, Driver& driver, Frame& frame);

 private:
  Ledger& ledger_;
  std::optional<FrameGate> gate_;
  CaptureClock clock_;
  ClockFit asked_;  ///< room for a reading of the driver
  unsigned session_ = 0;
};

}  // namespace tractiond::capture
