#include "daemon/publish/description.h"

#include <sys/random.h>

#include <cassert>
#include <charconv>
#include <fstream>

namespace tractiond::publish {

Id randomId() {
  Id id;
  [[maybe_unused]] const int failed = getentropy(id.data(), id.size());
  assert(failed == 0 && "16 bytes are always available");
  return id;
}

Id hostId() {
  Id id{};
  std::string text;
  std::getline(std::ifstream("/proc/sys/kernel/random/boot_id"), text);
  std::erase(text, '-');
  if (text.size() != 2 * id.size()) return id;
  for (std::size_t i = 0; i < id.size(); ++i) std::from_chars(&text[2 * i], &text[2 * i] + 2, id[i], 16);
  return id;
}

}  // namespace tractiond::publish
