// The newest picture, for subscribers to previews: copied on the tracking thread, reduced on a thread of its own.
#pragma once

#include "base/event.h"
#include "base/loan.h"
#include "daemon/publish/publisher.h"
#include "daemon/records/frame_copy.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/preview.h"

#include <chrono>
#include <cstdint>

namespace tractiond {

struct PreviewOptions {
  double rate_Hz = 10.0;  ///< of pictures, at most
  int width_px = 320;     ///< at most
};

/// Bound to its thread, but for takeFrame().
class Previewer {
 public:
  /// The publisher outlives this.
  Previewer(publish::Publisher& publisher, const PreviewOptions& options, std::int64_t (*clock)() = monotonicNow);

  /// On the tracking thread, after the frame was tracked: copies it if a picture is wanted. Allocates nothing.
  /// \param markers of the frame; null: it has not been tracked
  void takeFrame(const Frame& frame, const MarkerField* markers);

  /// Does what is due, or sleeps until something is, not longer than this.
  void turn(std::chrono::milliseconds timeout);

 private:
  struct Copy : FrameCopy {
    std::uint32_t flags = 0;
    Id zero{};
  };

  void offer(const Copy& copy, std::int64_t now_ns);

  publish::Publisher& publisher_;
  PreviewOptions options_;
  std::int64_t (*clock_)();
  Loan<Copy> loan_;
  Event taken_;
  bool lent_ = false;
  std::int64_t due_ns_ = 0;
  Preview preview_;
};

}  // namespace tractiond
