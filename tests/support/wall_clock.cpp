// Preloaded (LD_PRELOAD): the time of day of a program is ahead of the true one by what the file TRACTION_WALL_CLOCK
// holds, eight bytes [s], which another program may change.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>

namespace {

using Ahead = std::atomic<std::int64_t>;

std::int64_t ahead_s() {
  static const Ahead* const shared = [] {
    const char* const path = std::getenv("TRACTION_WALL_CLOCK");
    const int file = open(path == nullptr ? "" : path, O_RDONLY | O_CLOEXEC);
    void* const bytes = mmap(nullptr, sizeof(Ahead), PROT_READ, MAP_SHARED, file, 0);
    if (file >= 0) close(file);
    return bytes == MAP_FAILED ? nullptr : static_cast<const Ahead*>(bytes);
  }();
  return shared == nullptr ? 0 : shared->load();
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* now) noexcept {
  static const auto next = reinterpret_cast<int (*)(clockid_t, timespec*)>(dlsym(RTLD_NEXT, "clock_gettime"));
  const int result = next(clock, now);
  if (clock == CLOCK_REALTIME) now->tv_sec += ahead_s();
  return result;
}

extern "C" int gettimeofday(timeval* now, void* zone) noexcept {
  static const auto next = reinterpret_cast<int (*)(timeval*, void*)>(dlsym(RTLD_NEXT, "gettimeofday"));
  const int result = next(now, zone);
  now->tv_sec += ahead_s();
  return result;
}
