// Interface of a source of frames: a camera or a recording.
#pragma once

#include "daemon/records/frame.h"

#include <chrono>

namespace tractiond::capture {

enum class Next {
  kFrame,     ///< `frame` holds a new, whole picture
  kRejected,  ///< something arrived and was not usable; it is counted by cause in the ledger
  kTimeout,   ///< nothing arrived in time
  kEnd,       ///< there will be no more frames: a recording has ended, or the source has failed
};

/// One thread calls next() and recycle(); another one may call recycle() once that thread has ended.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// Waits for the next frame, about `timeout` at most; may return kTimeout earlier. Fills `frame` if it returns
  /// kFrame; its memory is borrowed until recycle(). Allocates nothing, takes no lock of this program, logs nothing.
  virtual Next next(Frame& frame, std::chrono::milliseconds timeout) = 0;

  /// Gives the memory of a frame of next() back; must be called once for each kFrame, in any order, also after kEnd.
  virtual void recycle(Frame& frame) = 0;
};

}  // namespace tractiond::capture
