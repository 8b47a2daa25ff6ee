#include "daemon/app/config_toml.h"
#include "tests/fuzz/target.h"
#include "tests/support/places.h"

#include <sstream>

namespace fuzz {

std::vector<std::string> seeds() {
  return {fileText(tractiond::test::source("config/tractiond.toml")),
          "camera.features = [{ BalanceRatioSelector = \"Red\" }, { BalanceRatio = 1.5 }, { UserSetLoad = true }]\n",
          "[publish]\nstream = [\"tcp://127.0.0.1:9882\", \"ipc:///run/x\"]\n"};
}

bool feed(std::string_view bytes) {
  std::istringstream text{std::string(bytes)};
  const auto config = tractiond::parseConfig(text, "fuzz");
  if (!config) return false;
  std::istringstream again(configText(*config));
  require(tractiond::parseConfig(again, "fuzz").has_value(), "what is printed is not read");
  return true;
}

}  // namespace fuzz
