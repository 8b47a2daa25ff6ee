// Decides why frames are missing: the camera is gone, the thread that receives its packets hangs, or it is only late.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace tractiond::capture {

enum class Silence { kAlive, kThreadHangs, kNoAnswer };

/// Observations of a stream. judgeSilence() calls them on its thread.
struct StreamSigns {
  std::function<std::uint64_t()> received;      ///< Returns the number of packets taken from the kernel so far.
  std::function<bool()> hasPacketsWaiting;      ///< Returns whether the kernel holds packets.
  std::function<bool()> isWaitingForProcessor;  ///< Returns ProcessorWait::lasts() of the receiving thread.
  std::function<bool()> answers;                ///< Returns whether the camera answers within its time.
  std::function<void()> pause;                  ///< Waits 50 ms.
};

/// Decides why frames are missing. kThreadHangs: for five pauses packets wait, the receiving thread takes none of them,
/// and it does not wait for a processor. kNoAnswer: the camera does not answer, and no packet arrives meanwhile.
/// Returns after 40 pauses at most.
Silence judgeSilence(const StreamSigns& signs);

/// Detects that a thread of this process is ready to run but gets no processor. Thread-bound.
class ProcessorWait {
 public:
  explicit ProcessorWait(int threadId);

  /// Returns whether the thread is ready to run and has not run since the call before (or the construction). False if
  /// the kernel does not report it.
  bool lasts();

 private:
  std::string folder_;
  std::uint64_t ran_ns_ = 0;
};

}  // namespace tractiond::capture
