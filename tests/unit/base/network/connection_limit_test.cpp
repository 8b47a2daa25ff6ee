// More connections than there are file descriptors: libzmq aborts where accept() fails for want of one.

#include "base/network/connection_limit.h"
#include "base/network/socket.h"
#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace tractiond::network::connection_limit_test {
namespace {

/// A process of its own, as whoever connects takes descriptors, too. It must be made before the limit is set.
class Crowd {
 public:
  Crowd() {
    EXPECT_EQ(pipe2(orders_.data(), O_CLOEXEC), 0);
    EXPECT_EQ(pipe2(reports_.data(), O_CLOEXEC), 0);
    child_ = fork();
    if (child_ == 0) live();
    close(orders_[0]);
    close(reports_[1]);
  }
  ~Crowd() { leave(); }
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

  /// Connects `count` times to an endpoint (tcp://127.0.0.1:PORT, ipc://PATH), and says nothing.
  void connectTo(const std::string& endpoint, int count) {
    Order order{};
    order.count = count;
    if (endpoint.starts_with("ipc://")) {
      sockaddr_un local{AF_UNIX, {}};
      endpoint.copy(local.sun_path, sizeof local.sun_path - 1, 6);
      std::memcpy(&order.address, &local, order.size = sizeof local);
    } else {
      sockaddr_in internet{};
      internet.sin_family = AF_INET;
      internet.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      internet.sin_port = htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
      std::memcpy(&order.address, &internet, order.size = sizeof internet);
    }
    EXPECT_EQ(write(orders_[1], &order, sizeof order), static_cast<ssize_t>(sizeof order));
    int connected = 0;
    EXPECT_EQ(read(reports_[0], &connected, sizeof connected), static_cast<ssize_t>(sizeof connected));
    EXPECT_EQ(connected, count);
  }

  /// Ends all connections.
  void leave() {
    if (child_ <= 0) return;
    close(orders_[1]);
    waitpid(std::exchange(child_, 0), nullptr, 0);
    close(reports_[0]);
  }

 private:
  struct Order {
    sockaddr_storage address;
    socklen_t size;
    int count;
  };

  /// Calls nothing that may wait for a thread of the parent's.
  [[noreturn]] void live() const {
    rlimit limit{};
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
    close(orders_[1]);
    for (Order order{}; read(orders_[0], &order, sizeof order) == sizeof order;) {
      int connected = 0;
      for (int i = 0; i < order.count; ++i) {
        const int one = socket(order.address.ss_family, SOCK_STREAM, 0);
        if (connect(one, reinterpret_cast<const sockaddr*>(&order.address), order.size) == 0) ++connected;
      }
      if (write(reports_[1], &connected, sizeof connected) < 0) break;
    }
    _exit(0);
  }

  std::array<int, 2> orders_{}, reports_{};
  pid_t child_ = 0;
};

/// Leaves this process so many descriptors for connections, until the end of the test.
class DescriptorLimit {
 public:
  explicit DescriptorLimit(int room) {
    getrlimit(RLIMIT_NOFILE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = static_cast<rlim_t>(lowestFree() + room) + connections::kReserved;
    EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &limit), 0);
  }
  ~DescriptorLimit() { setrlimit(RLIMIT_NOFILE, &before_); }
  DescriptorLimit(const DescriptorLimit&) = delete;
  DescriptorLimit& operator=(const DescriptorLimit&) = delete;

 private:
  /// Returns the lowest number that is free: all below are in use.
  static int lowestFree() {
    const int fd = open("/dev/null", O_RDONLY | O_CLOEXEC);
    close(fd);
    return fd;
  }
  rlimit before_{};
};

class ConnectionLimit : public testing::Test {
 protected:
  ConnectionLimit() {
    guard(publisher_, 100, 64);
    publisher_.set(zmq::sockopt::handshake_ivl, 0);  // who is silent stays, however slow the machine
    const auto bound = bind(publisher_, {"tcp://127.0.0.1:*", "ipc://" + (folder_.path() / "socket").string()});
    EXPECT_TRUE(bound);
    if (bound) bound_ = *bound;
  }
  ~ConnectionLimit() override { release(bound_); }

  zmq::socket_t subscribe(const std::string& endpoint) {
    zmq::socket_t subscriber(context_, zmq::socket_type::sub);
    subscriber.set(zmq::sockopt::linger, 0);
    subscriber.set(zmq::sockopt::subscribe, "");
    subscriber.connect(endpoint);
    return subscriber;
  }

  /// Sends until the subscriber hears something that was sent from now on.
  testing::AssertionResult hears(zmq::socket_t& subscriber) {
    const std::string text = std::to_string(++sent_);
    const bool heard = test::eventually([&] {
      publisher_.send(zmq::buffer(text), zmq::send_flags::dontwait);
      zmq_pollitem_t item = readable(subscriber);
      zmq_poll(&item, 1, 10);
      for (zmq::message_t message; subscriber.recv(message, zmq::recv_flags::dontwait);) {
        if (message.to_string_view() == text) return true;
      }
      return false;
    });
    return heard ? testing::AssertionSuccess() : testing::AssertionFailure() << "nothing is heard";
  }

  const test::TemporaryFolder folder_;
  Crowd crowd_;  // before threads are started
  zmq::context_t context_;
  zmq::socket_t publisher_{context_, zmq::socket_type::pub};
  std::vector<std::string> bound_;  ///< TCP, ipc
  int sent_ = 0;
};

TEST_F(ConnectionLimit, ConnectionsLeaveTheReservedDescriptorsFree) {
  constexpr int kRoom = 100, kCrowd = 200;  // descriptors for connections; connections to each endpoint
  std::vector<zmq::socket_t> honest;
  for (const std::string& endpoint : bound_) honest.push_back(subscribe(endpoint));
  for (zmq::socket_t& subscriber : honest) EXPECT_TRUE(hears(subscriber));

  connections::Report report;
  const std::uint64_t before = connections::refused();
  {
    const DescriptorLimit limit(kRoom);
    for (const std::string& endpoint : bound_) crowd_.connectTo(endpoint, kCrowd);
    EXPECT_TRUE(test::eventually([&] {
      poll(nullptr, 0, 10);
      return connections::refused() - before >= 2 * kCrowd - kRoom;
    })) << connections::refused() - before;

    std::vector<int> own;
    for (std::size_t i = 0; i < connections::kReserved; ++i) own.push_back(open("/dev/null", O_RDONLY | O_CLOEXEC));
    EXPECT_GE(*std::ranges::min_element(own), 0) << "the program itself lacks descriptors";
    for (const int fd : own) close(fd);
    for (zmq::socket_t& subscriber : honest) EXPECT_TRUE(hears(subscriber));
  }
  const std::string line = report.nextLine(1);
  EXPECT_NE(line.find(" connections were refused: "), std::string::npos) << line;
  EXPECT_NE(line.find("are kept for the program; "), std::string::npos) << line;
  EXPECT_EQ(report.nextLine(2), "");

  crowd_.leave();
  for (const std::string& endpoint : bound_) {
    zmq::socket_t newcomer = subscribe(endpoint);
    EXPECT_TRUE(hears(newcomer));
  }
}

TEST_F(ConnectionLimit, OfManyConnectionsThoseOfTheLargestPeerAreEstimated) {
  constexpr int kRoom = 400;
  connections::Report report(64);  // descriptors that are looked at
  const std::uint64_t before = connections::refused();
  const DescriptorLimit limit(kRoom);
  crowd_.connectTo(bound_[1], kRoom + 1);
  EXPECT_TRUE(test::eventually([&] {
    poll(nullptr, 0, 10);
    return connections::refused() > before;
  }));
  const std::string line = report.nextLine(1);
  const auto about = line.find(" has about ");
  ASSERT_NE(about, std::string::npos) << line;
  const int estimate = std::stoi(line.substr(about + std::string(" has about ").size()));
  EXPECT_GT(estimate, kRoom / 2) << line;
  EXPECT_LT(estimate, 2 * kRoom) << line;
}

TEST_F(ConnectionLimit, WithoutADescriptorLeftNothingAborts) {
  zmq::socket_t honest = subscribe(bound_[1]);
  EXPECT_TRUE(hears(honest));
  {
    const DescriptorLimit limit(-static_cast<int>(connections::kReserved));  // all that it may have are in use
    crowd_.connectTo(bound_[1], 10);                                         // they wait to be accepted
    EXPECT_TRUE(hears(honest));
  }
  zmq::socket_t newcomer = subscribe(bound_[1]);
  EXPECT_TRUE(hears(newcomer));
}

TEST(Accept, ErrorOfAConnectionThatIsGoneLetsTheListenerTryAgain) {
  // Linux passes on what the network said of the new connection (accept(2)). A kernel that says so is played by a
  // filter.
  for (const unsigned error : {EHOSTUNREACH, EMFILE, ENETDOWN, EPERM, ETIMEDOUT}) {
    const pid_t child = fork();
    if (child == 0) {
      std::array<sock_filter, 4> filter{{BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
                                         BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_accept4, 0, 1),
                                         BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | error),
                                         BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)}};
      const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
      prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
      if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0) _exit(1);
      _exit(accept4(-1, nullptr, nullptr, 0) < 0 && errno == ECONNABORTED ? 0 : 2);
    }
    int status = 0;
    EXPECT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 0) << strerror(static_cast<int>(error));
  }
}

}  // namespace
}  // namespace tractiond::network::connection_limit_test
