// Stands before the C library's functions, for ourselves as for the libraries.
#include "tests/unit/capture/wall_clock.h"

#include <dlfcn.h>
#include <sys/time.h>
#include <time.h>

namespace tractiond::test {

std::atomic<std::int64_t> wallClockAhead_s{0};

}  // namespace tractiond::test

extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  static const auto next = reinterpret_cast<int (*)(clockid_t, timespec*)>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = next(clock, now);
  if (clock == CLOCK_REALTIME) now->tv_sec += tractiond::test::wallClockAhead_s;
  return result;
}

extern "C" int gettimeofday(timeval* now, void* zone) noexcept {
  static const auto next = reinterpret_cast<int (*)(timeval*, void*)>(dlsym(RTLD_NEXT, "gettimeofday"));
  const int result = next(now, zone);
  now->tv_sec += tractiond::test::wallClockAhead_s;
  return result;
}
