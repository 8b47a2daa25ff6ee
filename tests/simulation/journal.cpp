#include "tests/simulation/journal.h"

#include <fmt/format.h>

namespace tractiond::simulation {

Journal::Journal()
    : begin_ns_(now()) {}

void Journal::say(const std::string& line) {
  result.log += fmt::format("{:>9} ms  {}\n", now_ms(), line);
}

void Journal::law(bool holds, const char* name, const std::string& what) const {
  if (!holds) throw Broken{name, what, now_ms()};
}

std::string nameOf(const Id& id) {
  return fmt::format("{:02x}{:02x}{:02x}{:02x}", id[0], id[1], id[2], id[3]);
}

}  // namespace tractiond::simulation
