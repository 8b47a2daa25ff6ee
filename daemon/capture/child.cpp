#include "daemon/capture/child.h"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstring>

namespace tractiond::capture {

void limitChild() {
  constexpr rlim_t kMemory_bytes = rlim_t{1} << 30, kProcessor_s = 5;
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  const auto limit = [](__rlimit_resource what, rlim_t most) {
    rlimit now{};
    if (getrlimit(what, &now) != 0 || now.rlim_cur <= most) return;
    now.rlim_cur = now.rlim_max = most;
    setrlimit(what, &now);
  };
  limit(RLIMIT_AS, pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kMemory_bytes);
  limit(RLIMIT_CPU, kProcessor_s);
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
}

std::string misdeed(const ChildEnd& end) {
  using How = ChildEnd::How;
  switch (end.how) {
  case How::kExit:
    return {};
  case How::kSignal:
    if (end.code == SIGXCPU || end.code == SIGKILL) return "takes more time or memory than any camera's";
    return "crashes what evaluates it (signal " + std::to_string(end.code) + ")";
  case How::kLate:
    return "takes longer than any camera's";
  case How::kTooMuch:
    return "makes what evaluates it talk without end";
  case How::kStopped:
    return "was not evaluated to its end";
  case How::kNotStarted:
    break;
  }
  return std::string("cannot be evaluated: no process can be started: ") + std::strerror(end.code);
}

}  // namespace tractiond::capture
