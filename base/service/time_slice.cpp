#include "base/service/time_slice.h"

#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdint>

namespace tractiond {
namespace {

/// As in sched_setattr(2), which not all versions of the C library declare.
struct Attributes {
  std::uint32_t size = sizeof(Attributes), policy = 0;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime_ns = 0, deadline_ns = 0, period_ns = 0;
};

}  // namespace

void shortenTimeSlice(int threadId) {
  constexpr std::uint64_t kSlice_ns = 100'000;
  Attributes attributes;  // with the nice value, which is to stay
  if (syscall(SYS_sched_getattr, threadId, &attributes, sizeof attributes, 0) != 0) return;
  if (attributes.policy != SCHED_OTHER) return;
  attributes.runtime_ns = kSlice_ns;
  syscall(SYS_sched_setattr, threadId, &attributes, 0);
}

}  // namespace tractiond
