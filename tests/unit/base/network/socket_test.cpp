#include "base/network/socket.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace tractiond::network::socket_test {
namespace {

namespace fs = std::filesystem;

class SocketTest : public testing::Test {
 protected:
  ~SocketTest() override { release(bound_); }

  tl::expected<std::vector<std::string>, Error> tryBind(zmq::socket_t& socket, const std::string& endpoint) {
    guard(socket, 4, 64);
    auto bound = bind(socket, {endpoint});
    if (bound) bound_.insert(bound_.end(), bound->begin(), bound->end());
    return bound;
  }

  /// Binds a socket that is not ZeroMQ's to a file. Returns its descriptor.
  int bindFile(const std::string& path, int type) {
    const int file = ::socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    EXPECT_EQ(::bind(file, plain(addressOf(path)), sizeof(sockaddr_un)), 0);
    return file;
  }
  static sockaddr_un addressOf(const std::string& path) {
    sockaddr_un address{AF_UNIX, {}};
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    return address;
  }
  static const sockaddr* plain(const sockaddr_un& address) { return reinterpret_cast<const sockaddr*>(&address); }

  Error refused(const std::string& endpoint) {
    zmq::socket_t socket(context_, zmq::socket_type::pub);
    const auto bound = tryBind(socket, endpoint);
    EXPECT_FALSE(bound) << endpoint;
    const Error error = bound ? Error{} : bound.error();
    EXPECT_NE(error.what.find(endpoint), std::string::npos) << error.message();
    return error;
  }

  const test::TemporaryFolder temporary_;
  const fs::path& folder_ = temporary_.path();
  std::vector<std::string> bound_;
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::pub};
};

TEST_F(SocketTest, TheNameOfThisHostIsItsLoopback) {
  const auto bound = tryBind(socket_, "tcp://localhost:*");
  ASSERT_TRUE(bound) << bound.error().message();
  EXPECT_TRUE(bound->front().starts_with("tcp://127.0.0.1:")) << bound->front();
}

TEST_F(SocketTest, ItsGroupMayConnectWhateverTheUmask) {
  const mode_t before = umask(0077);
  const fs::path path = folder_ / "control";
  EXPECT_TRUE(tryBind(socket_, "ipc://" + path.string()));
  umask(before);
  constexpr auto kMode =
      fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read | fs::perms::group_write;
  EXPECT_EQ(fs::status(path).permissions(), kMode);
}

TEST_F(SocketTest, PathInUseIsUnavailableAndStaysWithItsOwner) {
  const std::string endpoint = "ipc://" + (folder_ / "stream").string();
  ASSERT_TRUE(tryBind(socket_, endpoint));
  EXPECT_EQ(refused(endpoint).exitCode, EX_UNAVAILABLE);
  EXPECT_TRUE(fs::is_socket(folder_ / "stream"));
}

TEST_F(SocketTest, StaleSocketFileIsReplaced) {
  const std::string path = folder_ / "stream";
  close(bindFile(path, SOCK_STREAM));  // the file stays
  ASSERT_TRUE(fs::is_socket(path));
  EXPECT_TRUE(tryBind(socket_, "ipc://" + path));
}

TEST_F(SocketTest, SocketThatCannotBeConnectedToStaysWithItsOwner) {
  const std::string path = folder_ / "stream";
  const int owner = bindFile(path, SOCK_DGRAM);
  EXPECT_EQ(refused("ipc://" + path).exitCode, EX_CANTCREAT);
  EXPECT_TRUE(fs::is_socket(path));
  close(owner);
}

TEST_F(SocketTest, OrdinaryFileIsNotTouched) {
  std::ofstream(folder_ / "precious") << "data";
  EXPECT_EQ(refused("ipc://" + (folder_ / "precious").string()).exitCode, EX_CANTCREAT);
  EXPECT_EQ(fs::file_size(folder_ / "precious"), 4U);
}

TEST_F(SocketTest, TooLongAPathIsRefused) {
  EXPECT_EQ(refused("ipc://" + (folder_ / std::string(120, 'x')).string()).exitCode, EX_CONFIG);
}

TEST_F(SocketTest, NonsenseIsRefused) {
  EXPECT_EQ(refused("nonsense").exitCode, EX_CONFIG);
  EXPECT_EQ(refused("tcp://127.0.0.1:99999").exitCode, EX_CONFIG);
  EXPECT_NE(refused("tcp://192.0.2.1:9872").exitCode, EX_OK);
}

}  // namespace
}  // namespace tractiond::network::socket_test
