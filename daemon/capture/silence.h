// Decides why frames are missing: the camera is gone, the thread that receives its packets hangs, or it is only late.
#pragma once

#include <cstdint>
#include <string>

namespace tractiond::capture {

/// kAlive: frames are only late. kThreadHangs: the thread that receives packets takes none. kNoAnswer: the camera is
/// gone.
enum class Silence { kAlive, kThreadHangs, kNoAnswer };

/// Observations of a stream. Called within causeOfSilence(), on its thread.
class StreamSigns {
 public:
  virtual std::uint64_t received() = 0;  ///< Returns the number of packets that the thread has taken since the start.
  virtual bool hasPacketsWaiting() = 0;  ///< Returns whether the kernel holds packets for the thread.
  virtual bool isWaitingForProcessor() = 0;  ///< Returns whether the thread has waited since the last call.
  virtual bool answers() = 0;                ///< Returns whether the camera answers in time.
  virtual void pause() = 0;                  ///< Sleeps 50 ms.

 protected:
  ~StreamSigns() = default;
};

/// Returns the cause. The thread hangs if packets wait and it takes none of them in five pauses in which it does not
/// wait for a processor, or in 40 pauses in all. The camera is gone if it does not answer, and none of its packets
/// arrives meanwhile. Blocks for 40 pauses and one call of `answers` at most.
Silence causeOfSilence(StreamSigns& signs);

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
