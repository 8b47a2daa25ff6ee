// Makes frames of popped buffers: the frame gate judges each, the ledger counts it, the capture clock dates it.
#pragma once

#include "daemon/capture/camera_info.h"
#include "daemon/capture/device_clock.h"
#include "daemon/capture/driver.h"
#include "daemon/capture/frame_gate.h"
#include "daemon/records/frame.h"
#include "daemon/records/ledger.h"

#include <optional>

namespace tractiond::capture {

/// Thread-bound. admit() allocates nothing.
class Intake {
 public:
  /// The ledger must outlive this.
  explicit Intake(Ledger& ledger)
      : ledger_(ledger) {}

  /// Begins a session of the camera, of the number info.session; must be called before admit(). Pictures must keep the
  /// shape of the first session, and those of earlier sessions stay known: one that comes again is stale. \param
  /// buffers number of buffers of the driver; used in the first session
  void begin(const CameraInfo& info, int buffers);

  /// Judges and counts a buffer of the session. Must be called for every buffer that Driver::pop() returned, in order
  /// and at once: the time of the call becomes FrameTimes::receivedReal_ns. If the verdict is kNew, fills the frame;
  /// else leaves it as it is. The frame borrows the buffer's memory, and its token is the buffer's handle. \param
  /// driver that the buffer comes from
  Judgement admit(const Buffer& buffer, Driver& driver, Frame& frame);

 private:
  Ledger& ledger_;
  std::optional<FrameGate> gate_;
  CaptureClock clock_;
  ClockFit asked_;  ///< room for a reading of the driver
  unsigned session_ = 0;
};

}  // namespace tractiond::capture
