#include "daemon/config_toml.h"
#include "tests/fuzz/target.h"

#include <sstream>

namespace fuzz {

std::vector<std::string> seeds() {
  return {fileText(SOURCE "/config/tractiond.toml"),
          "camera.features = [{ BalanceRatioSelector = \"Red\" }, { BalanceRatio = 1.5 }, { UserSetLoad = true }]\n",
          "[publish]\nstream = [\"tcp://127.0.0.1:9882\", \"ipc:///run/x\"]\n"};
}

void feed(std::string_view bytes) {
  std::istringstream text{std::string(bytes)};
  if (const auto config = tractiond::parseConfig(text, "fuzz")) {
    std::istringstream again(configText(*config));
    require(tractiond::parseConfig(again, "fuzz").has_value(), "what is printed is not read");
  }
}

}  // namespace fuzz
