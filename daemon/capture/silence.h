// Decides why frames are missing: the camera is gone, the thread that receives its packets hangs, or it is only late.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace tractiond::capture {

/// kAlive: frames are only late. kThreadHangs: the thread that receives packets takes none. kNoAnswer: the camera is
/// gone.
enum class Silence { kAlive, kThreadHangs, kNoAnswer };

/// Observations of a stream. Called within causeOfSilence(), on its thread.
struct StreamSigns {
  std::function<std::uint64_t()> received;      ///< number of packets that the thread has taken since the start
  std::function<bool()> hasPacketsWaiting;      ///< tells whether the kernel holds packets for the thread
  std::function<bool()> isWaitingForProcessor;  ///< tells whether the thread has waited since the last call
  std::function<bool()> answers;                ///< tells whether the camera answers in time
  std::function<void()> pause;                  ///< sleeps 50 ms
};

/// Returns the cause. The thread hangs if packets wait and it takes none of them in five pauses in which it does not
/// wait for a processor, or in 40 pauses in all. The camera is gone if it does not answer, and none of its packets
/// arrives meanwhile. Blocks for 40 pauses and one call of `answers` at most.
Silence causeOfSilence(const StreamSigns& signs);

/// Notices that a thread of this process waits for a processor. Thread-bound.
class ProcessorWait {
 public:
  /// \param threadId id of the thread, as gettid(2) returns it
  explicit ProcessorWait(int threadId);

  /// Returns whether the thread is ready to run and has not run since the call before (or the construction). False if
  /// the kernel does not report it.
  bool lasts();

 private:
  std::string folder_;
  std::uint64_t ran_ns_ = 0;
};

}  // namespace tractiond::capture
