// Real time: how the kernel runs the threads that a frame passes, and memory that stays. It may refuse what is asked;
// so what holds is read back from it.
#pragma once

#include "base/fixed_text.h"

#include <sched.h>
#include <tl/expected.hpp>

#include <array>
#include <mutex>
#include <string>

namespace traction::v1 {
class Scheduling;
}

namespace tractiond {

/// By default nothing is asked for.
struct RealtimeOptions {
  int priority = 0;         ///< SCHED_FIFO, of the threads that a frame passes; 0: run as all others
  std::string cpus = {};    ///< these may run on, in the kernel's list format: "0-2,5"; empty: any
  bool lockMemory = false;  ///< what has been touched is not taken away again
};

/// The kernel's list format. Fails, in words, for what is none; an empty one has no processor.
tl::expected<cpu_set_t, std::string> parseCpus(const std::string& list);
/// Allocates nothing beyond the text that it returns; a list without end is cut between two items.
FixedText<120> cpusText(const cpu_set_t& cpus);

/// Of one process. Thread-safe.
class Realtime {
 public:
  /// \param options with a list of processors that can be read
  explicit Realtime(RealtimeOptions options);

  /// From here on, if it is asked for. Needs CAP_IPC_LOCK or no limit (RLIMIT_MEMLOCK): below a limit, memory that is
  /// wanted later would be refused, and libraries end the process then.
  void lockMemory();

  /// The calling thread, under the name that it has, is one that a frame passes, until leave().
  void enter();
  void leave();
  /// A library's thread, which sends what the others made: one step below them, so that whoever floods it keeps no
  /// frame waiting. It lives as long as this.
  void adopt(int threadId);

  /// Sets what was asked and what the kernel says now. Waits for nobody; allocates nothing once the message has the
  /// room. \return false: another thread is at it, and nothing is set
  bool read(traction::v1::Scheduling& status);

  /// One line of what was granted, and a warning with what mends it for each thing that was not; nothing where nothing
  /// is asked.
  void report();

 private:
  void include(int threadId, int priority);

  const RealtimeOptions options_;
  const cpu_set_t cpus_;
  std::mutex mutex_;
  struct Thread {
    int id = 0;  ///< 0: none
    FixedText<15> name;
  };
  // One of Aravis's that hangs, or takes its time to end, may be there besides its successor.
  std::array<Thread, 12> threads_{};
  // errno of what was refused; 0: nothing.
  int priorityError_ = 0;
  int cpusError_ = 0;
  int memoryError_ = 0;
};

/// The thread of this process that has the name; 0: none has it within 100 ms, as one that has just been started.
int threadCalled(const std::string& name);

}  // namespace tractiond
