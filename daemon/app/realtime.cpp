#include "daemon/app/realtime.h"

#include "base/directory.h"
#include "base/service/time_slice.h"
#include "traction/v1/status.pb.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <regex>
#include <sstream>
#include <thread>
#include <utility>

namespace tractiond {
namespace {

/// Returns the name of a thread; empty if it has ended.
std::string nameOf(int threadId) {
  std::string name;
  std::getline(std::ifstream(fmt::format("/proc/self/task/{}/comm", threadId)), name);
  return name;
}

tl::unexpected<std::string> noList(const std::string& list) {
  return tl::unexpected(fmt::format("= \"{}\" is no list of processors like 0-2,5, each below {}", list, CPU_SETSIZE));
}

}  // namespace

std::uint64_t memorySize(std::string_view key) {
  std::array<char, 4096> text{};
  const int file = ::open("/proc/self/status", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  const ssize_t size = ::read(file, text.data(), text.size() - 1);
  ::close(file);
  const std::size_t found =
      std::string_view(text.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0))).find(key);
  return found == std::string_view::npos ? 0 : std::strtoull(&text[found + key.size()], nullptr, 10) * 1024;
}

tl::expected<cpu_set_t, std::string> parseCpus(const std::string& list) {
  static const std::regex kItem(R"(([0-9]{1,4})(-([0-9]{1,4}))?)");
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  bool isGood = !list.ends_with(',');
  std::istringstream items(list);
  for (std::string item; std::getline(items, item, ',');) {
    std::smatch found;
    if (!std::regex_match(item, found, kItem)) return noList(list);
    const int first = std::stoi(found[1]), last = found[3].matched ? std::stoi(found[3]) : first;
    isGood = isGood && first <= last && last < CPU_SETSIZE;
    for (int cpu = first; isGood && cpu <= last; ++cpu) CPU_SET(cpu, &cpus);
  }
  return isGood ? tl::expected<cpu_set_t, std::string>(cpus) : noList(list);
}

std::string cpusText(const cpu_set_t& cpus) {
  std::string text;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &cpus)) continue;
    text += (text.empty() ? "" : ",") + std::to_string(cpu);
    const int first = cpu;
    while (cpu + 1 < CPU_SETSIZE && CPU_ISSET(cpu + 1, &cpus)) ++cpu;
    if (cpu != first) text += "-" + std::to_string(cpu);
  }
  return text;
}

Realtime::Realtime(RealtimeOptions options)
    : options_(std::move(options))
    , cpus_(parseCpus(options_.cpus).value()) {}

void Realtime::lockMemory() {
  if (!options_.lockMemory) return;
  rlimit before{};
  getrlimit(RLIMIT_MEMLOCK, &before);
  rlimit limit = before;
  // A process may lock memory under a limit only with the capability; without it, mlockall() fails with a limit of 0.
  limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? RLIM_INFINITY : 0;
  setrlimit(RLIMIT_MEMLOCK, &limit);
  // The stacks of some twenty threads, and reserves of libraries, have not been touched yet.
  const int error = mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0 ? 0 : errno;
  if (limit.rlim_cur == 0) setrlimit(RLIMIT_MEMLOCK, &before);
  const std::lock_guard lock(mutex_);
  memoryError_ = error;
}

void Realtime::enter() {
  include(gettid(), options_.priority);
}

void Realtime::adopt(int threadId) {
  include(threadId, std::max(options_.priority - 1, std::min(options_.priority, 1)));
}

void Realtime::include(int threadId, int priority) {
  const std::lock_guard lock(mutex_);
  if (CPU_COUNT(&cpus_) > 0 && sched_setaffinity(threadId, sizeof cpus_, &cpus_) != 0) cpusError_ = errno;
  if (priority > 0) {
    sched_param param{};
    param.sched_priority = priority;
    // Threads that it starts get the default scheduling.
    if (sched_setscheduler(threadId, SCHED_FIFO | SCHED_RESET_ON_FORK, &param) != 0) priorityError_ = errno;
  } else {
    shortenTimeSlice(threadId);
  }
  threads_[threadId] = nameOf(threadId);
}

void Realtime::leave() {
  const std::lock_guard lock(mutex_);
  threads_.erase(gettid());
}

void Realtime::read(traction::v1::Scheduling& status) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (lock) fill(status);
}

/// Must be called with the mutex locked.
void Realtime::fill(traction::v1::Scheduling& status) const {
  status.set_asked_priority(static_cast<std::uint32_t>(options_.priority));
  status.set_asked_cpus(cpusText(cpus_));
  status.set_asked_lock(options_.lockMemory);
  status.set_locked_bytes(options_.lockMemory ? memorySize("VmLck:") : 0);
  status.clear_threads();
  for (const auto& [id, name] : threads_) {
    sched_param param{};
    cpu_set_t cpus;
    if (sched_getparam(id, &param) != 0 || sched_getaffinity(id, sizeof cpus, &cpus) != 0) continue;
    traction::v1::ThreadScheduling& thread = *status.add_threads();
    thread.set_name(name);
    thread.set_priority(static_cast<std::uint32_t>(param.sched_priority));
    thread.set_cpus(cpusText(cpus));
  }
}

void Realtime::report() {
  if (options_.priority == 0 && options_.cpus.empty() && !options_.lockMemory) return;
  traction::v1::Scheduling status;
  {
    const std::lock_guard lock(mutex_);
    fill(status);
  }
  std::string threads;
  bool allHave = true, allThere = true;
  const std::string wanted = cpusText(cpus_);
  std::string cpus = wanted;
  for (const traction::v1::ThreadScheduling& thread : status.threads()) {
    threads +=
        fmt::format("{}{} {} on {}", threads.empty() ? "" : ", ", thread.name(), thread.priority(), thread.cpus());
    allHave = allHave && (options_.priority == 0 || thread.priority() > 0);
    if (!wanted.empty() && thread.cpus() != wanted) allThere = false, cpus = thread.cpus();
  }
  spdlog::info("real time: {}; memory {}locked", threads, status.locked_bytes() > 0 ? "" : "not ");
  const std::lock_guard lock(mutex_);
  if (!allHave) {
    spdlog::warn("warning: realtime.priority = {} is not granted: {}; allow it to the service: LimitRTPRIO={} and "
                 "RestrictRealtime=no by systemctl edit",
                 options_.priority, std::strerror(priorityError_), options_.priority);
  }
  if (!allThere) {
    spdlog::warn("warning: realtime.cpus = \"{}\" is not granted{}{}: it runs on {}; name processors that are there, "
                 "and that AllowedCPUs= of the service has",
                 options_.cpus, cpusError_ == 0 ? "" : ": ", cpusError_ == 0 ? "" : std::strerror(cpusError_), cpus);
  }
  if (options_.lockMemory && status.locked_bytes() == 0) {
    spdlog::warn("warning: realtime.lock_memory is not granted: {}; allow it to the service: LimitMEMLOCK=infinity by "
                 "systemctl edit",
                 std::strerror(memoryError_));
  }
}

int threadCalled(const std::string& name) {
  constexpr std::chrono::milliseconds kTurn{1};
  constexpr int kTurns = 100;
  for (int i = 0; i < kTurns; ++i) {
    for (const auto& thread : entriesOf("/proc/self/task")) {
      const int threadId = std::stoi(thread.filename());
      if (nameOf(threadId) == name) return threadId;
    }
    std::this_thread::sleep_for(kTurn);
  }
  return 0;
}

}  // namespace tractiond
