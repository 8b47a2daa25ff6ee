#include "base/clock.h"
#include "daemon/capture/gvcp_search.h"
#include "tests/support/deadline.h"
#include "tests/support/seed.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <random>
#include <thread>
#include <vector>

namespace tractiond::capture::gvcp_search_test {
namespace {

using std::chrono::milliseconds;

/// Answers searches on a port of its own, after junk drawn at random; it loses the first questions.
class Answerer {
 public:
  explicit Answerer(unsigned seed, int lost = 0)
      : random_(seed)
      , lost_(lost)
      , socket_(socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    bind(socket_, reinterpret_cast<sockaddr*>(&address), size);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size);
    port = ntohs(address.sin_port);
    timeval patience{0, 20'000};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    for (std::size_t i = 0; i < 22; ++i) identity += static_cast<char>(random_());
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ~Answerer() {
    thread_.request_stop();
    thread_.join();
    close(socket_);
  }

  std::uint16_t port = 0;
  std::string identity;

 private:
  void run(const std::stop_token& stop) {
    for (int questions = 0; !stop.stop_requested();) {
      std::array<std::uint8_t, 600> question{};
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const auto got =
          recvfrom(socket_, question.data(), question.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (got != 8 || question[0] != 0x42 || question[3] != 0x02 || ++questions <= lost_) continue;
      const auto send = [&](const std::vector<char>& packet) {
        sendto(socket_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
      };
      for (auto i = random_() % 5; i > 0; --i) {
        std::vector<char> junk(random_() % 600);
        for (char& one : junk) one = static_cast<char>(random_());
        if (junk.size() > 3) junk[3] = 4;
        send(junk);
      }
      std::vector<char> answer(256);
      answer[3] = 0x03;
      answer[5] = static_cast<char>(248);
      answer[6] = static_cast<char>(question[6]);
      answer[7] = static_cast<char>(question[7]);
      std::copy_n(identity.begin(), 6, answer.begin() + 8 + 0x0a);
      std::copy_n(identity.begin() + 6, 16, answer.begin() + 8 + 0xd8);
      send({answer.begin(), answer.begin() + static_cast<std::ptrdiff_t>(random_() % 240)});  // cut short
      send(answer);
    }
  }

  std::mt19937 random_;
  int lost_;
  int socket_;
  std::jthread thread_;
};

TEST(GvcpSearch, IsAnsweredByTheCameraWhateverElseComes) {
  auto camera = std::make_unique<Answerer>(test::seed());
  GvcpSearch search(camera->port);
  EXPECT_EQ(search.ask("127.0.0.1", test::kHung), camera->identity);
  EXPECT_EQ(search.locate(camera->identity, "127.0.0.1", test::kHung, {}), "127.0.0.1");
  EXPECT_EQ(search.locate("another camera's mark.", "127.0.0.1", milliseconds(200), {}), "");
  EXPECT_EQ(search.ask("127.0.0.9", milliseconds(40)), "") << "nobody is there";
  camera.reset();  // while answers may still wait
  EXPECT_EQ(search.ask("127.0.0.1", milliseconds(40)), "");
}

TEST(GvcpSearch, AsksOnceMoreInHalfOfTheTime) {
  const Answerer camera(test::seed(), 1);
  EXPECT_EQ(GvcpSearch(camera.port).ask("127.0.0.1", milliseconds(4000)), camera.identity);
}

TEST(GvcpSearch, EndsWhenItIsToldTo) {
  std::stop_source stop;
  GvcpSearch search(1);
  const std::int64_t begin_ns = monotonicNow();
  std::jthread soon([&] { stop.request_stop(); });
  EXPECT_EQ(search.locate("nobody", "127.0.0.9", milliseconds(60'000), stop.get_token()), "");
  EXPECT_LT(monotonicNow() - begin_ns, 30'000'000'000);
}

}  // namespace
}  // namespace tractiond::capture::gvcp_search_test
