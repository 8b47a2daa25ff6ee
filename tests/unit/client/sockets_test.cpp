#include "client/cli/sockets.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>

namespace traction::client::sockets_test {
namespace {

namespace fs = std::filesystem;

class RepeaterTest : public testing::Test {
 protected:
  static std::optional<ErrorCode> codeAt(const std::string& endpoint) {
    try {
      const Repeater repeater(endpoint);
      return std::nullopt;
    } catch (const Error& error) {
      return error.code();
    }
  }

  const tractiond::test::TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
};

TEST_F(RepeaterTest, RefusesAnEndpointInUse) {
  const std::string endpoint = "ipc://" + (folder_ / "stream").string();
  {
    const Repeater first(endpoint);
    EXPECT_EQ(codeAt(endpoint), ErrorCode::kBadEndpoint);
    EXPECT_EQ(codeAt(first.endpoint()), ErrorCode::kBadEndpoint);
    const Repeater port("tcp://127.0.0.1:*");
    EXPECT_EQ(codeAt(port.endpoint()), ErrorCode::kBadEndpoint);
  }
  EXPECT_EQ(codeAt(endpoint), std::nullopt);  // it may have left its file behind
}

TEST_F(RepeaterTest, RefusesAPortThatIsNone) {
  for (const char* port : {"65536", "70000", "-1", "1e3", "80x", ""}) {
    EXPECT_EQ(codeAt("tcp://127.0.0.1:" + std::string(port)), ErrorCode::kBadEndpoint) << port;
  }
  EXPECT_EQ(codeAt("tcp://127.0.0.1:0"), std::nullopt);
}

TEST_F(RepeaterTest, LeavesAFileThatIsNoSocket) {
  const fs::path file = folder_ / "notes";
  std::ofstream(file) << "kept";
  EXPECT_EQ(codeAt("ipc://" + file.string()), ErrorCode::kBadEndpoint);
  EXPECT_TRUE(fs::is_regular_file(file));
  EXPECT_EQ(codeAt("ipc://" + (folder_ / "none" / "stream").string()), ErrorCode::kBadEndpoint);
}

}  // namespace
}  // namespace traction::client::sockets_test
