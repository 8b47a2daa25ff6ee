#include "base/clock.h"

namespace tractiond {

std::int64_t clockNow(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace tractiond
