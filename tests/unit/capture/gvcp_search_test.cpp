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

/// A camera at a port of its own.
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

  /// Searches, and answers the question by these packets.
  bool isFound(milliseconds timeout, const std::vector<std::vector<char>>& packets) {
    const std::jthread camera([&] {
      std::array<std::uint8_t, 600> question{};
      sockaddr_in from{};
      socklen_t size = sizeof from;
      EXPECT_EQ(recvfrom(socket_, question.data(), question.size(), 0, reinterpret_cast<sockaddr*>(&from), &size), 8);
      EXPECT_EQ(question[3], 0x02);
      for (const std::vector<char>& each : packets)
        sendto(socket_, each.data(), each.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
    });
    return answersSearch("127.0.0.1", timeout, port_);
  }

 private:
  int socket_ = socket(AF_INET, SOCK_DGRAM, 0);
  std::uint16_t port_ = 0;
};

TEST_F(AnswersSearch, KnowsTheCamerasAnswerWhateverElseComes) {
  std::mt19937 random(test::seed());
  std::vector<char> answer(256), other(600);
  answer[3] = 0x03;
  for (char& each : other) each = static_cast<char>(random());
  other[3] = 4;
  const std::vector<char> cut(answer.begin(), answer.begin() + static_cast<std::ptrdiff_t>(random() % 256));
  EXPECT_TRUE(isFound(test::kHung, {other, cut, answer}));
  EXPECT_FALSE(isFound(milliseconds(40), {other, cut})) << "what came is no answer";
}

}  // namespace
}  // namespace tractiond::capture::gvcp_search_test
