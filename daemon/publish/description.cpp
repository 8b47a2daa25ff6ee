#include "daemon/publish/description.h"

#include <sys/random.h>
#include <systemd/sd-id128.h>

#include <cassert>
#include <iterator>

namespace tractiond::publish {

Id randomId() {
  Id id;
  [[maybe_unused]] const int failed = getentropy(id.data(), id.size());
  assert(failed == 0 && "16 bytes are always available");
  return id;
}

std::string hostId() {
  sd_id128_t boot{};
  return sd_id128_get_boot(&boot) == 0 ? std::string(std::begin(boot.bytes), std::end(boot.bytes)) : "";
}

}  // namespace tractiond::publish
