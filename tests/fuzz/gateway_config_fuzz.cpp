#include "gateway/config.h"
#include "tests/fuzz/target.h"

#include <sstream>

namespace fuzz {

std::vector<std::string> seeds() {
  return {fileText(SOURCE "/config/gateway.toml"), "[gateway]\nstream = [\"tcp://*:9882\"]\n[limits]\npeers = 3\n"};
}

void feed(std::string_view bytes) {
  std::istringstream text{std::string(bytes)};
  if (const auto config = tractiond::gateway::parseConfig(text, "fuzz")) {
    std::istringstream again(configText(*config));
    require(tractiond::gateway::parseConfig(again, "fuzz").has_value(), "what is printed is not read");
  }
}

}  // namespace fuzz
