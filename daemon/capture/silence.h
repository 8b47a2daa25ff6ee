// Frames are missing: has the camera gone, does the thread hang that receives its packets, or is it only late?
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace tractiond::capture {

enum class Silence { kAlive, kThreadHangs, kNoAnswer };

/// What is known of a stream. Called within judgeSilence(), on its thread.
struct StreamSigns {
  std::function<std::uint64_t()> received;      ///< packets since its start, taken from the kernel
  std::function<bool()> hasPacketsWaiting;      ///< the kernel holds some
  std::function<bool()> isWaitingForProcessor;  ///< the receiving thread has been, since the call before
  std::function<bool()> answers;                ///< the camera does, within its time
  std::function<void()> pause;                  ///< of 50 ms
};

/// Says why frames are missing. The receiving thread hangs if packets wait, it takes none of them, and it does not wait
/// for a processor, in five pauses; a camera has gone if it does not answer, and none of its packets comes meanwhile.
/// Returns after 40 pauses at most.
Silence judgeSilence(const StreamSigns& signs);

/// Notices when the kernel keeps a thread of this process from running. Thread-bound.
class ProcessorWait {
 public:
  explicit ProcessorWait(int threadId);

  /// Returns whether the thread wants to run, and has not run since the call before (or the construction). False where
  /// the kernel does not say.
  bool lasts();

 private:
  std::string folder_;
  std::uint64_t ran_ns_ = 0;
};

}  // namespace tractiond::capture
