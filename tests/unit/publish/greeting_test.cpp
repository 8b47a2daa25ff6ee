#include "daemon/publish/greeting.h"
#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <zmq.hpp>

#include <chrono>
#include <cstring>
#include <string>
#include <thread>

namespace tractiond::publish::greeting_test {
namespace {

class GreetingTest : public testing::Test {
 protected:
  std::string path() const { return folder_.path() / "socket"; }

  const test::TemporaryFolder folder_;
};

TEST_F(GreetingTest, ComesFromZeroMQ) {
  zmq::context_t context;
  zmq::socket_t socket(context, zmq::socket_type::router);
  socket.bind("ipc://" + path());
  Greeting greeting("ipc://" + path());
  EXPECT_TRUE(greeting.poll()) << "nothing is known yet";
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(test::eventually([&] {
      if (greeting.poll()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      return false;
    }));
  }
}

TEST_F(GreetingTest, DoesNotComeWhereNobodyAccepts) {
  const int listening = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, path().c_str());
  ASSERT_EQ(bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(listen(listening, 10), 0);
  Greeting greeting("ipc://" + path());
  EXPECT_TRUE(greeting.poll());
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(greeting.poll());
  close(listening);
}

TEST_F(GreetingTest, OfOtherEndpointsNothingIsKnown) {
  Greeting greeting("tcp://127.0.0.1:9870");
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(greeting.poll());
}

}  // namespace
}  // namespace tractiond::publish::greeting_test
