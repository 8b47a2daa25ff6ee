#include "gateway/config.h"
#include "tests/fuzz/target.h"
#include "tests/support/places.h"

#include <sstream>

namespace fuzz {

std::vector<std::string> seeds() {
  return {fileText(tractiond::test::source("config/gateway.toml")),
          "[gateway]\nstream = [\"tcp://*:9882\"]\n[limits]\nrequests_per_s_each = 3\n"};
}

bool feed(std::string_view bytes) {
  std::istringstream text{std::string(bytes)};
  const auto config = tractiond::gateway::parseConfig(text, "fuzz");
  if (!config) return false;
  std::istringstream again(configText(*config));
  require(tractiond::gateway::parseConfig(again, "fuzz").has_value(), "what is printed is not read");
  return true;
}

}  // namespace fuzz
