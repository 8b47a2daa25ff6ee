// Connections whose peers read nothing.

#include "base/network/inflow_limit.h"
#include "daemon/publish/frozen_peers.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/base/network/raw_peer.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <string>
#include <vector>

namespace tractiond::publish::frozen_peers_test {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

class FrozenPeersOf : public testing::Test {
 protected:
  FrozenPeersOf() {
    path_.copy(address_.sun_path, sizeof address_.sun_path - 1);
    EXPECT_EQ(bind(listener_, address(), sizeof address_), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
  }
  ~FrozenPeersOf() override {
    for (const int fd : open_) close(fd);
    close(listener_);
  }

  struct Ends {
    int ours = -1, theirs = -1;
  };
  /// \param number of the descriptor of our end; 0: any
  Ends connection(int number = 0) {
    Ends ends;
    ends.theirs = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(connect(ends.theirs, address(), sizeof address_), 0);
    ends.ours = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (number != 0) {
      EXPECT_EQ(dup2(ends.ours, number), number);
      close(ends.ours);
      ends.ours = number;
    }
    open_.insert(open_.end(), {ends.ours, ends.theirs});
    return ends;
  }

  static void sendTo(const Ends& ends) { EXPECT_EQ(send(ends.ours, "x", 1, MSG_DONTWAIT), 1); }

  /// Reads all that waits. Returns whether our end has been ended.
  static bool isCutOff(const Ends& ends) {
    char byte = 0;
    ssize_t count = 1;
    while (count > 0) count = recv(ends.theirs, &byte, 1, MSG_DONTWAIT);
    return count == 0;
  }

  FrozenPeers peers(int mostAtOnce) {
    return {{"ipc://" + path_}, [this](const std::string& line) { told_.push_back(line); }, mostAtOnce};
  }

  const sockaddr* address() const { return reinterpret_cast<const sockaddr*>(&address_); }

  const test::TemporaryFolder folder_;
  const std::string path_ = folder_.path() / "socket";
  sockaddr_un address_{AF_UNIX, {}};
  int listener_ = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::vector<int> open_;
  std::vector<std::string> told_;
};

TEST_F(FrozenPeersOf, OneThatReadsNothingForFiveSecondsIsCutOff) {
  FrozenPeers frozen = peers(1'000'000);
  const Ends deaf = connection(), slow = connection(), idle = connection(), between = connection();
  for (const Ends& each : {deaf, slow, between}) sendTo(each);
  frozen.endFrozen(10 * kSecond_ns);
  sendTo(between);
  frozen.endFrozen(10 * kSecond_ns);  // examines nothing within a second of the round before
  sendTo(slow);                       // another number of bytes waits, as where some are read
  frozen.endFrozen(14 * kSecond_ns);
  EXPECT_EQ(told_, std::vector<std::string>());
  frozen.endFrozen(15 * kSecond_ns);
  EXPECT_EQ(told_, std::vector<std::string>{
                       "1 subscribers have read nothing for 5 s, and are cut off until they connect again"});
  EXPECT_TRUE(isCutOff(deaf));
  EXPECT_FALSE(isCutOff(slow));
  EXPECT_FALSE(isCutOff(idle));
  EXPECT_FALSE(isCutOff(between));
}

TEST_F(FrozenPeersOf, OneThatAsksOnReadsItsAnswersThoughOneWaitsAtEachLook) {
  network::inflow::watch("ipc://" + path_, network::Charge::kRequests);
  FrozenPeers frozen = peers(1'000'000);
  const Ends asks = connection(), hasAsked = connection();
  const auto ask = [](const Ends& ends, const std::string& bytes) {
    EXPECT_EQ(send(ends.theirs, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
    std::array<char, 128> read{};
    EXPECT_EQ(recv(ends.ours, read.data(), read.size(), 0), static_cast<ssize_t>(bytes.size()));
  };
  for (const Ends& each : {asks, hasAsked}) {
    ask(each, network::RawPeer::greeting());
    sendTo(each);
  }
  for (int second = 10; second < 30; second += 2) {
    ask(asks, network::RawPeer::message("x"));
    frozen.endFrozen(second * kSecond_ns);
  }
  EXPECT_FALSE(isCutOff(asks));
  EXPECT_TRUE(isCutOff(hasAsked));
  network::inflow::unwatch({"ipc://" + path_});
}

TEST_F(FrozenPeersOf, ManyDescriptorsAreExaminedInSeveralCalls) {
  constexpr int kAtOnce = 16, kNumber = 10 * kAtOnce + 1, kCalls = kNumber / kAtOnce + 1;
  FrozenPeers frozen = peers(kAtOnce);
  const Ends deaf = connection(kNumber);
  const auto endFrozen = [&](int second, int calls) {
    for (int i = 0; i < calls; ++i) frozen.endFrozen(second * kSecond_ns);
  };
  const int all = getdtablesize() / kAtOnce + 1;
  sendTo(deaf);
  endFrozen(10, all);
  endFrozen(20, kCalls - 1);
  EXPECT_EQ(told_.size(), 0U) << "more was examined in one call";
  endFrozen(20, all);
  EXPECT_EQ(told_.size(), 1U);
  EXPECT_TRUE(isCutOff(deaf));
}

}  // namespace
}  // namespace tractiond::publish::frozen_peers_test
