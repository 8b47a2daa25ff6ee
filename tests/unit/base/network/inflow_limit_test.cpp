// Peers that fill ZeroMQ's queues, and an honest one beside them. Memory itself is measured by tools/faults.

#include "base/clock.h"
#include "base/network/ends.h"
#include "base/network/inflow_limit.h"
#include "base/network/socket.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/base/network/raw_peer.h"

#include <gtest/gtest.h>

#include <deque>
#include <optional>

namespace tractiond::network::inflow_limit_test {
namespace {

constexpr std::size_t kMuch = 256 << 20;  ///< bytes; ended long before

/// \param GetParam() an endpoint; "ipc": one in a folder of the test
class InflowLimit : public testing::TestWithParam<const char*> {
 protected:
  void open(zmq::socket_type type) {
    std::string endpoint = GetParam();
    if (endpoint == "ipc") endpoint = "ipc://" + (folder_.path() / "socket").string();
    socket_ = zmq::socket_t(context_, type);
    guard(socket_, 16, 65'536);
    const auto bound = bind(socket_, {endpoint});
    ASSERT_TRUE(bound);
    bound_ = *bound;
    before_ = inflow::ended();
    report_.emplace();
  }
  ~InflowLimit() override {
    release(bound_);
    socket_.close();
    for (const Charge charge : {Charge::kRequests, Charge::kSubscriptions}) inflow::releaseEnded(charge);
  }

  /// Takes all that waits, as our programs do.
  int take() {
    for (int count = 0;; ++count) {
      std::size_t parts = 0;
      int source = -1;
      for (bool more = true; more;) {
        zmq::message_t message;
        if (!socket_.recv(message, zmq::recv_flags::dontwait)) return inflow::releaseEnded(Charge::kRequests), count;
        source = sourceOf(message);
        ++parts;
        more = message.more();
      }
      inflow::release(source, parts - 1);
    }
  }

  /// Returns the report on the connections that were ended since open(), for a test that fails.
  std::string told() { return report_->nextLine(monotonicNow()); }

  /// A honest peer is heard.
  void expectHeard() {
    RawPeer honest(bound_.at(0), "DEALER");
    honest.send(RawPeer::part("") + RawPeer::message("hello"));
    EXPECT_TRUE(test::eventually([&] {
      zmq_pollitem_t item = readable(socket_);
      zmq_poll(&item, 1, 10);
      zmq::message_t message;
      while (socket_.recv(message, zmq::recv_flags::dontwait)) {
        if (message.to_string_view() == "hello") return true;
      }
      return false;
    })) << told();
  }

  const test::TemporaryFolder folder_;
  zmq::context_t context_;
  zmq::socket_t socket_;
  std::vector<std::string> bound_;
  std::uint64_t before_ = 0;
  std::optional<inflow::Report> report_;
};

INSTANTIATE_TEST_SUITE_P(Publish, InflowLimit, testing::Values("tcp://127.0.0.1:*", "ipc"),
                         [](const auto& instance) { return std::string(instance.index == 0 ? "Tcp" : "Ipc"); });

TEST_P(InflowLimit, PartsWithoutAnEndCutThePeerOffAndNobodyElse) {
  open(zmq::socket_type::router);
  for (const char* body : {"", "x", "forty bytes, for which a buffer is kept.."}) {
    RawPeer peer(bound_.at(0), "DEALER");
    EXPECT_TRUE(peer.flood(RawPeer::part(body), kMuch) || peer.isCutOff());
    expectHeard();
  }
  EXPECT_EQ(inflow::ended() - before_, 3U);
}

TEST_P(InflowLimit, PartsWithoutAnEndCutASubscriberOff) {
  for (const auto type : {zmq::socket_type::xpub, zmq::socket_type::pub}) {
    open(type);
    RawPeer peer(bound_.at(0), "SUB");
    EXPECT_TRUE(peer.flood(RawPeer::part("x"), kMuch) || peer.isCutOff());
    RawPeer subscriber(bound_.at(0), "SUB");
    EXPECT_TRUE(subscriber.flood(RawPeer::message("\1" + std::string(60, 'x')), kMuch) || subscriber.isCutOff());
    EXPECT_EQ(inflow::ended() - before_, 2U);
    release(bound_);
    bound_.clear();
    socket_.close();
  }
}

TEST_P(InflowLimit, MessagesThatNobodyTakesCutThePeerOff) {
  open(zmq::socket_type::router);
  RawPeer peer(bound_.at(0), "DEALER");
  EXPECT_TRUE(peer.flood(RawPeer::message("x"), kMuch) || peer.isCutOff());
  EXPECT_EQ(inflow::ended() - before_, 1U);
}

TEST_P(InflowLimit, MessagesThatAreTakenMayBeAny) {
  open(zmq::socket_type::router);
  RawPeer peer(bound_.at(0), "DEALER");
  std::string some;
  for (int i = 0; i < 100; ++i) some += RawPeer::part("") + RawPeer::message(std::string(200, 'x'));
  for (int sent = 0; sent < 20'000; sent += 100) {  // some 6 MiB
    peer.send(some);
    int taken = 0;
    EXPECT_TRUE(test::eventually([&] {
      zmq_pollitem_t item = readable(socket_);
      zmq_poll(&item, 1, 10);
      taken += take();
      return taken == 100;
    }));
  }
  EXPECT_EQ(inflow::ended(), before_);
}

TEST_P(InflowLimit, ManyPeersTogetherMayHoldNoMore) {
  open(zmq::socket_type::router);
  RawPeer first(bound_.at(0), "DEALER");
  std::deque<RawPeer> peers;
  constexpr std::size_t kEach = 800 << 10;  // below what one may hold
  while (peers.size() < 2 * inflow::kMostTogether_bytes / kEach) peers.emplace_back(bound_.at(0), "DEALER");
  RawPeer last(bound_.at(0), "DEALER");
  for (RawPeer* honest : {&first, &last}) honest->send(RawPeer::part(""));
  for (RawPeer& peer : peers) peer.flood(RawPeer::part(""), kEach / 64 * 2);
  EXPECT_TRUE(test::eventually([&] { return inflow::ended() - before_ >= peers.size() / 2 - 1; }));
  take();
  for (RawPeer* honest : {&first, &last}) {
    honest->send(RawPeer::message("hello"));
    EXPECT_TRUE(test::eventually([&] { return take() == 1; })) << "who holds less than others stays; " << told();
  }
}

TEST_P(InflowLimit, NothingIsCountedAnyMoreAfterTheLastEndpoint) {
  for (std::uint64_t sent = 0; sent <= inflow::kMostTogether_bytes; sent += inflow::kMost_bytes) {
    open(zmq::socket_type::router);
    RawPeer peer(bound_.at(0), "DEALER");
    EXPECT_TRUE(peer.flood(RawPeer::part("x"), kMuch) || peer.isCutOff());
    release(bound_);
    socket_.close();
  }
  open(zmq::socket_type::router);
  expectHeard();
}

/// The kernel gives the next connection the same descriptor, also while messages of the one before wait.
class CountedMessages : public InflowLimit {
 protected:
  static constexpr std::size_t kAllowed = 20, kLeft = 2 * kAllowed;

  static std::string many(std::size_t number) {
    std::string all;
    for (std::size_t i = 0; i < number; ++i) all += RawPeer::part("") + RawPeer::message("more");
    return all;
  }

  /// Takes and counts messages until one with this text has come.
  bool takeUntil(const std::string& text) {
    return test::eventually([&] {
      zmq_pollitem_t item = readable(socket_);
      zmq_poll(&item, 1, 10);
      for (zmq::message_t message; socket_.recv(message, zmq::recv_flags::dontwait);) {
        if (message.more()) continue;
        source_ = sourceOf(message);
        inflow::release(source_, 2);
        limit_.count(message, 2, bound_);
        if (message.to_string_view() == text) return true;
      }
      return false;
    });
  }

  /// Lets a connection come, leave kLeft messages, and end. Sets descriptor_.
  void leaveMessages() {
    open(zmq::socket_type::router);
    RawPeer leaves(bound_.at(0), "DEALER");
    leaves.send(RawPeer::part("") + RawPeer::message("first") + many(kLeft));
    ASSERT_TRUE(takeUntil("first"));
    descriptor_ = source_;
    EXPECT_EQ(inflow::sentOver(descriptor_), 2 * (kLeft + 1)) << "parts";
  }
  void awaitItsEnd() const {
    EXPECT_TRUE(test::eventually([&] { return localEnd(descriptor_).empty(); }));
    EXPECT_EQ(inflow::sentOver(descriptor_), 0U);
  }

  PeerLimit limit_ = PeerLimit(kAllowed);
  int source_ = -1, descriptor_ = -1;
};

INSTANTIATE_TEST_SUITE_P(Publish, CountedMessages, testing::Values("tcp://127.0.0.1:*", "ipc"),
                         [](const auto& instance) { return std::string(instance.index == 0 ? "Tcp" : "Ipc"); });

TEST_P(CountedMessages, WhatAConnectionLeftIsNotCountedForTheNextOne) {
  leaveMessages();
  awaitItsEnd();
  RawPeer next(bound_.at(0), "DEALER");
  next.send(RawPeer::part("") + RawPeer::message("hello"));
  ASSERT_TRUE(takeUntil("hello"));
  EXPECT_EQ(source_, descriptor_);
  limit_.reset();
  next.send(RawPeer::part("") + RawPeer::message("again"));
  EXPECT_TRUE(takeUntil("again")) << "it was cut off; " << told();
}

TEST_P(CountedMessages, NobodySendsMoreBecauseAnotherLeftMessages) {
  leaveMessages();
  awaitItsEnd();
  RawPeer next(bound_.at(0), "DEALER");
  next.send(many(2 * kLeft + kAllowed) + RawPeer::part("") + RawPeer::message("beyond"));
  ASSERT_TRUE(takeUntil("beyond"));
  EXPECT_EQ(source_, descriptor_);
  EXPECT_TRUE(next.isCutOff());
}

TEST_P(CountedMessages, WhatWasLeftAndTakenBeforeAConnectionBeganIsNotTakenForItsOwn) {
  leaveMessages();
  awaitItsEnd();
  for (std::size_t i = 0; i < kLeft; ++i) ASSERT_TRUE(takeUntil("more"));
  RawPeer next(bound_.at(0), "DEALER");
  next.send(many(kLeft + kAllowed) + RawPeer::part("") + RawPeer::message("beyond"));
  ASSERT_TRUE(takeUntil("beyond"));
  EXPECT_EQ(source_, descriptor_);
  EXPECT_TRUE(next.isCutOff());
}

TEST_P(CountedMessages, AreCountedForEachConnectionByItself) {
  open(zmq::socket_type::router);
  RawPeer quiet(bound_.at(0), "DEALER"), floods(bound_.at(0), "DEALER");
  const auto say = [&](RawPeer& peer, const std::string& text) {
    peer.send(RawPeer::part("") + RawPeer::message(text));
    ASSERT_TRUE(takeUntil(text));
  };
  for (std::size_t i = 0; i <= kAllowed; ++i) {
    if (i % 2 == 0) say(quiet, "hello");
    say(floods, "more");
  }
  EXPECT_TRUE(floods.isCutOff());
  say(quiet, "again");
}

TEST_P(InflowLimit, OlderProtocolIsNotLetIn) {
  open(zmq::socket_type::router);
  std::string greeting = RawPeer::greeting();
  greeting[10] = 1;
  RawPeer old(bound_.at(0));
  old.send(greeting);
  EXPECT_TRUE(old.isCutOff());
  EXPECT_EQ(inflow::ended() - before_, 1U);
  expectHeard();
}

TEST_P(InflowLimit, WhatWasDoneIsTold) {
  open(zmq::socket_type::router);
  constexpr std::int64_t now_ns = 1'000'000'000'000;
  inflow::Report report;
  RawPeer peer(bound_.at(0), "DEALER");
  EXPECT_TRUE(peer.flood(RawPeer::part("x"), kMuch) || peer.isCutOff());
  const std::string line = report.nextLine(now_ns);
  EXPECT_TRUE(line.starts_with("1 connections were closed; the last was ")) << line;
  EXPECT_NE(line.find(GetParam() == std::string("ipc") ? "uid " : "127.0.0.1"), std::string::npos) << line;
  RawPeer second(bound_.at(0), "DEALER");
  EXPECT_TRUE(second.flood(RawPeer::part("x"), kMuch) || second.isCutOff());
  EXPECT_EQ(report.nextLine(now_ns + 59'000'000'000), "") << "at most once a minute";
  EXPECT_TRUE(report.nextLine(now_ns + 61'000'000'000).starts_with("1 connections"));
  EXPECT_EQ(report.nextLine(now_ns + 122'000'000'000), "");
}

/// Connections that are read as ZeroMQ reads them, and closed when the test says so.
class OwnConnections : public testing::Test {
 protected:
  OwnConnections() {
    sockaddr_in address{.sin_family = AF_INET, .sin_port = 0, .sin_addr = {htonl(INADDR_LOOPBACK)}, .sin_zero = {}};
    socklen_t size = sizeof address;
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    EXPECT_TRUE(bind(listener_, any, size) == 0 && listen(listener_, 64) == 0);
    EXPECT_EQ(getsockname(listener_, any, &size), 0);
    endpoint_ = "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
    inflow::watch(endpoint_, Charge::kRequests);
  }
  ~OwnConnections() override {
    inflow::unwatch({endpoint_});
    for (const int fd : open_) close(fd);
    close(listener_);
  }

  /// Reads messages of a new connection. \param share of what one may hold, in percent
  void hold(std::size_t share) {
    RawPeer& peer = peers_.emplace_back(endpoint_);
    const int fd = open_.emplace_back(accept(listener_, nullptr, nullptr));
    peer.send(RawPeer::greeting());
    constexpr std::size_t kCost_bytes = 64;
    peer.flood(RawPeer::part(""), RawPeer::part("").size() * share * inflow::kMost_bytes / 100 / kCost_bytes);
    std::array<char, 4096> bytes;
    while (recv(fd, bytes.data(), bytes.size(), MSG_DONTWAIT) > 0) {
    }
  }

  const int listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string endpoint_;
  std::deque<RawPeer> peers_;
  std::vector<int> open_;
  const std::uint64_t before_ = inflow::ended();
};

TEST_F(OwnConnections, AreNotCountedAnyMoreWhenTheyWereEnded) {
  hold(101);
  EXPECT_EQ(inflow::ended() - before_, 1U);
  for (int i = 0; i < 8; ++i) hold(98);
  EXPECT_EQ(inflow::ended() - before_, 1U);
}

/// ZeroMQ closes a connection for reasons of its own, too.
TEST_F(OwnConnections, AreNotCountedAnyMoreWhereTheyWereClosedBeforeTheirEndWasRead) {
  for (int i = 0; i < 8; ++i) hold(98);
  for (const int fd : open_) dup2(listener_, fd);  // closes it, and lets no other connection have the descriptor
  hold(99);
  EXPECT_EQ(inflow::ended(), before_);
}

TEST(InflowLimitDeathTest, ReadingByOtherCallsIsToldOnce) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a new process, in which nothing has been read
  EXPECT_EXIT(
      {
        constexpr std::int64_t now_ns = 1'000'000'000'000;
        inflow::Report report;
        inflow::release(0, 1);
        const std::string line = report.nextLine(now_ns);
        const bool isTold = line.find("were not seen to be accepted and read") != std::string::npos;
        std::_Exit(isTold && report.nextLine(now_ns + 61'000'000'000).empty() ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace tractiond::network::inflow_limit_test
