// Real-time scheduling of the threads that a frame passes, and locked memory. The kernel may refuse both; what it
// granted is read back.
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

/// By default nothing is requested.
struct RealtimeOptions {
  int priority = 0;         ///< SCHED_FIFO priority of the threads that a frame passes; 0: none
  std::string cpus = {};    ///< processors of these threads, in the kernel's list format: "0-2,5"; empty: any
  bool lockMemory = false;  ///< keeps memory that was touched
};

/// Parses the kernel's list format. Fails with a sentence; an empty list has no processor.
tl::expected<cpu_set_t, std::string> parseCpus(const std::string& list);
/// Formats a list of processors. Allocates only the result; cuts a very long list between two items.
FixedText<120> cpusText(const cpu_set_t& cpus);

/// Scheduling of this process. Thread-safe.
class Realtime {
 public:
  /// \param options with a valid list of processors
  explicit Realtime(RealtimeOptions options);

  /// Locks memory from now on, if requested. Needs CAP_IPC_LOCK or no limit (RLIMIT_MEMLOCK): under a limit, later
  /// allocations would be refused, at which libraries end the process.
  void lockMemory();

  /// Registers the calling thread, by its name, as one that a frame passes, until leave().
  void enter();
  void leave();
  /// Adopts a library's thread that sends the results, one priority below the others, so that a flood of it does not
  /// delay frames. It must live as long as this.
  void adopt(int threadId);

  /// Sets in the message what was requested and what the kernel reports now. Does not wait; allocates nothing once the
  /// message has the room. Returns false, and sets nothing, while another thread uses it.
  bool read(traction::v1::Scheduling& status);

  /// Logs what was granted, and a warning with a remedy for each refusal; nothing if nothing was requested.
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
  // A thread of Aravis that hangs, or ends late, may exist beside its successor.
  std::array<Thread, 12> threads_{};
  // errno of what was refused; 0: nothing.
  int priorityError_ = 0;
  int cpusError_ = 0;
  int memoryError_ = 0;
};

/// Returns the thread of this process with this name. Waits 100 ms for a thread that has just been started; 0: none.
int threadCalled(const std::string& name);

}  // namespace tractiond
