#include "daemon/publish/description.h"

#include <sys/random.h>
#include <systemd/sd-id128.h>

#include <algorithm>
#include <cassert>

namespace tractiond::publish {

Id randomId() {
  Id id;
  [[maybe_unused]] const int failed = getentropy(id.data(), id.size());
  assert(failed == 0 && "16 bytes are always available");
  return id;
}

Id hostId() {
  Id id{};
  sd_id128_t boot{};
  if (sd_id128_get_boot(&boot) == 0) std::ranges::copy(boot.bytes, id.begin());
  return id;
}

}  // namespace tractiond::publish
