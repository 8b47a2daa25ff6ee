#include "gateway/config.h"
#include "tests/support/places.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>

namespace tractiond::gateway::config_test {
namespace {

std::string errorOf(const std::string& text) {
  std::istringstream stream(text);
  const auto config = parseConfig(stream, "gateway.toml");
  if (config) return "";
  EXPECT_EQ(config.error().exitCode, EX_CONFIG);
  return config.error().message();
}

TEST(GatewayConfig, ShippedFileIsTheDefaultsWithEveryKey) {
  std::ifstream stream(test::source("config/gateway.toml"));
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(text, configText(Config{})) << "run: traction-gateway --print-config > config/gateway.toml";
}

TEST(GatewayConfig, MistakesAreNamed) {
  EXPECT_NE(errorOf("[gateway]\nstream = [\"ipc:///run/x\"]").find("which is not tcp://ADDRESS:PORT"),
            std::string::npos);
  EXPECT_NE(errorOf("[gateway]\ncontrol = []").find("gateway.control is empty"), std::string::npos)
      << errorOf("[gateway]\ncontrol = []");
  EXPECT_NE(errorOf("[gateway]\ninsecur = true").find("insecure"), std::string::npos);
  EXPECT_NE(errorOf("[limits]\nrequests_per_s = 0").find("gateway.toml:2"), std::string::npos);
}

}  // namespace
}  // namespace tractiond::gateway::config_test
