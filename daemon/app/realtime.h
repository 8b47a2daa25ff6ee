// Real-time scheduling of the threads that a frame passes, and locked memory. The kernel may refuse a setting, so the
// settings in force are read back.
#pragma once

#include "daemon/capture/aravis_driver.h"

#include <sched.h>
#include <tl/expected.hpp>

#include <map>
#include <mutex>
#include <string>
#include <string_view>

namespace traction::v1 {
class Scheduling;
}

namespace tractiond {

/// By default only short time slices are requested, for which no right is needed.
struct RealtimeOptions {
  int priority = 0;         ///< SCHED_FIFO priority of the threads that a frame passes; 0: the default scheduling
  std::string cpus = {};    ///< processors for these threads, in the kernel's list format: "0-2,5"; empty: any
  bool lockMemory = false;  ///< true: memory that has been touched stays resident
};

/// Parses a list of processors like "0-2,5", without blanks, line ends or strides, each below CPU_SETSIZE (1024);
/// whether they exist is not checked. An empty list has no processor. Fails with the rest of a sentence that begins
/// with the key: `= "..." is no list ...`.
tl::expected<cpu_set_t, std::string> parseCpus(const std::string& list);
/// Returns a size in /proc/self/status, by its key: "VmRSS:" [bytes]; 0 if there is none. Allocates nothing.
std::uint64_t memorySize(std::string_view key);
/// Returns processors in the kernel's list format, "0-2,5"; empty for none.
std::string cpusText(const cpu_set_t& cpus);

/// Settings of this process. Thread-safe.
class Realtime final : public capture::ThreadWatch {
 public:
  /// Applies nothing yet.
  /// \param options with `cpus` that parseCpus() accepts; others throw tl::bad_expected_access
  explicit Realtime(RealtimeOptions options);

  /// Locks memory from now on, if the options request it; report() tells of a failure. Needs CAP_IPC_LOCK or no limit
  /// (RLIMIT_MEMLOCK): with a limit, later memory would be refused, and libraries end the process then.
  void lockMemory();

  /// Applies the options to the calling thread, as one that a frame passes. Registers it with its present name until
  /// leave(). report() tells of a refusal. Threads that it starts get the default scheduling, but the same processors.
  void enter() override;
  /// Removes the calling thread from the registered ones; its scheduling stays.
  void leave() override;
  /// Applies the options to a library's thread that sends messages, with a priority one below a requested one (but at
  /// least 1), so that a client that floods it does not delay frames, and registers it as enter() does. The thread must
  /// live as long as this.
  void adopt(int threadId);

  /// Sets in `status` what was requested and what is in force now for the registered threads, without those that have
  /// ended. Leaves it as it is while another thread is registered: the caller may be one that must not wait.
  void read(traction::v1::Scheduling& status);

  /// Logs one line about what was granted, and a warning with its remedy for each thing that was not. Logs nothing if
  /// nothing is requested.
  void report();

 private:
  void include(int threadId, int priority);
  void fill(traction::v1::Scheduling& status) const;

  const RealtimeOptions options_;
  const cpu_set_t cpus_;
  std::mutex mutex_;
  std::map<int, std::string> threads_;  ///< names of the registered threads, by their ids
  // errno of what was refused; 0: nothing.
  int priorityError_ = 0;
  int cpusError_ = 0;
  int memoryError_ = 0;
};

/// Returns the id of a thread of this process with that name, of at most 15 characters; waits up to 100 ms for one that
/// has just been started. Returns 0 if there is none.
int threadCalled(const std::string& name);

}  // namespace tractiond
