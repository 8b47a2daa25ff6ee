#include "daemon/capture/gvcp_search.h"
#include "tests/support/deadline.h"
#include "tests/support/seed.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <random>
#include <thread>
#include <vector>

namespace tractiond::capture::gvcp_search_test {
namespace {

using std::chrono::milliseconds;

/// A camera at a port of its own, which answers one question.
class AnswersSearch : public testing::Test {
 protected:
  AnswersSearch() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    bind(socket_, reinterpret_cast<sockaddr*>(&address), size);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
  }
  ~AnswersSearch() override { close(socket_); }

  /// Loses so many questions, and answers the next, after junk drawn at random.
  std::jthread answer(int lost) {
    return std::jthread([this, lost] {
      std::array<std::uint8_t, 600> question{};
      sockaddr_in from{};
      socklen_t size = sizeof from;
      for (int i = 0; i <= lost; ++i)
        EXPECT_EQ(recvfrom(socket_, question.data(), question.size(), 0, reinterpret_cast<sockaddr*>(&from), &size), 8);
      EXPECT_EQ(question[0], 0x42);
      EXPECT_EQ(question[3], 0x02);
      const auto send = [&](const std::vector<char>& packet) {
        sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
      };
      for (auto i = random_() % 5; i > 0; --i) {
        std::vector<char> junk(random_() % 600);
        for (char& one : junk) one = static_cast<char>(random_());
        if (junk.size() > 3) junk[3] = 4;
        send(junk);
      }
      std::vector<char> discovery(256);
      discovery[3] = 0x03;
      send({discovery.begin(), discovery.begin() + static_cast<std::ptrdiff_t>(random_() % 256)});  // cut short
      if (answers_) send(discovery);
    });
  }

  std::mt19937 random_{test::seed()};
  int socket_ = socket(AF_INET, SOCK_DGRAM, 0);
  std::uint16_t port_ = 0;
  bool answers_ = true;
};

TEST_F(AnswersSearch, KnowsTheCamerasAnswerWhateverElseComes) {
  {
    const std::jthread camera = answer(0);
    EXPECT_TRUE(answersSearch("127.0.0.1", test::kHung, port_));
  }
  answers_ = false;
  const std::jthread camera = answer(0);
  EXPECT_FALSE(answersSearch("127.0.0.1", milliseconds(40), port_)) << "what came is no answer";
}

TEST_F(AnswersSearch, AsksOnceMoreInHalfOfTheTime) {
  const std::jthread camera = answer(1);
  EXPECT_TRUE(answersSearch("127.0.0.1", milliseconds(4000), port_));
}

}  // namespace
}  // namespace tractiond::capture::gvcp_search_test
