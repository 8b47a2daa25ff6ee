// Makes previews, reduced pictures for display, while a client subscribes to them: the tracking thread copies a frame,
// the previewer's own thread reduces the copy.
#pragma once

#include "base/event.h"
#include "base/loan.h"
#include "daemon/publish/publisher.h"
#include "daemon/records/frame_copy.h"
#include "daemon/records/marker_field.h"
#include "daemon/records/preview.h"

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tractiond {

struct PreviewOptions {
  double rate_Hz = 10.0;  ///< upper limit of the rate of previews; above 0
  int width_px = 320;     ///< upper limit of their width; above 0
};

/// Bound to its thread, except for takeFrame().
class Previewer {
 public:
  /// The publisher must outlive this. Any thread.
  /// \throws std::system_error if the process has no file descriptor left
  Previewer(publish::Publisher& publisher, const PreviewOptions& options)
      : publisher_(publisher)
      , options_(options) {}

  /// Takes over how many bytes a frame of the camera has, so that there is memory for the first one. Thread-safe.
  void setFrameSize(std::size_t frame_bytes) { frame_bytes_.store(frame_bytes, std::memory_order_relaxed); }

  /// Copies the frame if turn() has asked for one, and wakes turn(). A frame that is larger than the memory is left
  /// out; turn() then enlarges it for a later one. For the tracking thread, after the frame was tracked. Allocates
  /// nothing.
  /// \param markers of the frame; nullptr: it has not been tracked
  void takeFrame(const Frame& frame, const MarkerField* markers);

  /// Hands a frame that was copied, reduced, to the publisher, and asks takeFrame() for the next one when that is due.
  /// Then sleeps until a frame is copied or one is due, at most `timeout`. Only sleeps while no client subscribes to
  /// previews. A preview that the publisher cannot take is dropped. Allocates.
  void turn(std::chrono::milliseconds timeout);

 private:
  struct Copy : FrameCopy {
    std::uint32_t flags = 0;
    Id zero{};
  };

  void offer(const Copy& copy, std::int64_t now_ns);

  publish::Publisher& publisher_;
  PreviewOptions options_;
  Loan<Copy> loan_;
  Event taken_;
  bool lent_ = false;
  std::int64_t due_ns_ = 0;
  std::atomic<std::size_t> frame_bytes_{0};
  Preview preview_;
};

}  // namespace tractiond
