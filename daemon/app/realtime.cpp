#include "daemon/app/realtime.h"

#include "base/service/time_slice.h"
#include "traction/v1/status.pb.h"

#include <dirent.h>
#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <string_view>
#include <thread>
#include <utility>

namespace tractiond {
namespace {

/// Reads a file into `room`, without a terminating zero. Returns the number of bytes. Allocates nothing.
std::size_t readFile(const char* path, char* room, std::size_t size) {
  const int file = ::open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  const auto got = ::read(file, room, size);
  ::close(file);
  return got > 0 ? static_cast<std::size_t>(got) : 0;
}

/// Returns VmLck of /proc/self/status [bytes].
std::uint64_t lockedMemory() {
  constexpr std::string_view kKey = "VmLck:";
  std::array<char, 4096> room{};
  const std::string_view text(room.data(), readFile("/proc/self/status", room.data(), room.size() - 1));
  const auto found = text.find(kKey);
  return found == std::string_view::npos ? 0 : std::strtoull(&text[found + kKey.size()], nullptr, 10) * 1024;
}

/// Returns the name of a thread, in `room`, which is larger than any name of the kernel.
std::string_view nameOf(int threadId, std::array<char, 32>& room) {
  std::array<char, 48> path{};
  std::snprintf(path.data(), path.size(), "/proc/self/task/%d/comm", threadId);
  const std::size_t size = readFile(path.data(), room.data(), room.size());
  return {room.data(), size > 0 && room[size - 1] == '\n' ? size - 1 : size};
}

}  // namespace

tl::expected<cpu_set_t, std::string> parseCpus(const std::string& list) {
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  const char* at = list.data();
  const char* const end = at + list.size();
  const auto number = [&](unsigned& value) {
    const auto [behind, error] = std::from_chars(at, end, value);
    at = behind;
    return error == std::errc() && value < CPU_SETSIZE;
  };
  const auto failed = [&] {
    return tl::unexpected(
        fmt::format("= \"{}\" is no list of processors like 0-2,5, each below {}", list, CPU_SETSIZE));
  };
  while (at != end) {
    unsigned first = 0;
    if (!number(first)) return failed();
    unsigned last = first;
    if (at != end && *at == '-' && (++at, !number(last))) return failed();
    if (last < first) return failed();
    for (unsigned cpu = first; cpu <= last; ++cpu) CPU_SET(cpu, &cpus);
    if (at != end && (*at != ',' || ++at == end)) return failed();
  }
  return cpus;
}

FixedText<120> cpusText(const cpu_set_t& cpus) {
  constexpr std::string_view kMore = ",...";
  constexpr std::size_t kItem = 10;  // ",1022-1023"
  std::array<char, 120> text{};
  char* at = text.data();
  const auto write = [&](int number) { at = std::to_chars(at, text.data() + text.size(), number).ptr; };
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &cpus)) continue;
    const auto left = static_cast<std::size_t>(text.data() + text.size() - at);
    if (left < kItem + 1 + kMore.size()) {
      at = std::copy(kMore.begin(), kMore.end(), at);
      break;
    }
    if (at != text.data()) *at++ = ',';
    write(cpu);
    const int first = cpu;
    while (cpu + 1 < CPU_SETSIZE && CPU_ISSET(cpu + 1, &cpus)) ++cpu;
    if (cpu == first) continue;
    *at++ = '-';
    write(cpu);
  }
  return FixedText<120>({text.data(), static_cast<std::size_t>(at - text.data())});
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
  const auto free = std::ranges::find(threads_, 0, &Thread::id);
  if (free == threads_.end()) return;  // it is scheduled, but not listed
  std::array<char, 32> room{};
  free->id = threadId;
  free->name.assign(nameOf(threadId, room));
}

void Realtime::leave() {
  const std::lock_guard lock(mutex_);
  const auto own = std::ranges::find(threads_, static_cast<int>(gettid()), &Thread::id);
  if (own != threads_.end()) own->id = 0;
}

bool Realtime::read(traction::v1::Scheduling& status) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock.owns_lock()) return false;
  status.set_asked_priority(static_cast<std::uint32_t>(options_.priority));
  status.mutable_asked_cpus()->assign(cpusText(cpus_).view());
  status.set_asked_lock(options_.lockMemory);
  status.set_locked_bytes(options_.lockMemory ? lockedMemory() : 0);
  status.clear_threads();  // cleared elements keep their memory
  for (const auto& [id, name] : threads_) {
    sched_param param{};
    cpu_set_t cpus;
    if (id == 0 || sched_getparam(id, &param) != 0 || sched_getaffinity(id, sizeof cpus, &cpus) != 0) continue;
    traction::v1::ThreadScheduling& thread = *status.add_threads();
    thread.mutable_name()->assign(name.view());
    thread.set_priority(static_cast<std::uint32_t>(param.sched_priority));
    thread.mutable_cpus()->assign(cpusText(cpus).view());
  }
  return true;
}

void Realtime::report() {
  if (options_.priority == 0 && options_.cpus.empty() && !options_.lockMemory) return;
  traction::v1::Scheduling status;
  while (!read(status)) std::this_thread::yield();
  std::string threads;
  bool allHave = true, allThere = true;
  const std::string wanted(cpusText(cpus_).view());
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
    DIR* const folder = opendir("/proc/self/task");
    int found = 0;
    while (const dirent* const entry = folder == nullptr ? nullptr : readdir(folder)) {
      const int threadId = static_cast<int>(std::strtol(entry->d_name, nullptr, 10));
      std::array<char, 32> room{};
      if (threadId != 0 && nameOf(threadId, room) == name) found = threadId;
    }
    if (folder != nullptr) closedir(folder);
    if (found != 0) return found;
    std::this_thread::sleep_for(kTurn);
  }
  return 0;
}

}  // namespace tractiond
