// Subscriptions as a publisher receives them from peers that say more than ZeroMQ's own would.

#include "base/network/inflow_limit.h"
#include "base/network/socket.h"
#include "base/network/subscriptions.h"
#include "tests/support/seed.h"
#include "tests/unit/base/network/raw_peer.h"

#include <gtest/gtest.h>

#include <array>
#include <deque>
#include <map>
#include <random>
#include <set>
#include <string>

namespace tractiond::network {
namespace {

class SubscriptionsTest : public testing::Test {
 protected:
  SubscriptionsTest() {
    guard(publisher_, 8, 512);
    publisher_.set(zmq::sockopt::xpub_verboser, true);
    bound_ = *bind(publisher_, {"tcp://127.0.0.1:*"});
  }
  ~SubscriptionsTest() override { release(bound_); }

  /// Receives the next message, and notes it, as a publisher does.
  void note() {
    zmq::message_t message;
    ASSERT_TRUE(publisher_.recv(message));
    settleSubscription(message, true);
    subscriptions_.note(message);
  }

  /// Notes what ZeroMQ tells of the end of a connection, before it closes the descriptor.
  void noteEnd() {
    zmq::message_t cancellation(std::string_view("\0a", 2));
    subscriptions_.note(cancellation);
  }

  zmq::context_t context_;
  zmq::socket_t publisher_{context_, zmq::socket_type::xpub};
  std::vector<std::string> bound_;
  Subscriptions subscriptions_;
};

TEST_F(SubscriptionsTest, ARepeatedSubscriptionIsOne) {
  EXPECT_TRUE(subscriptions_.empty());
  RawPeer peer(bound_[0], "SUB");
  for (const char* text : {"\1a", "\1a", "\1b"}) peer.send(RawPeer::message(text));
  for (int i = 0; i < 3; ++i) note();
  EXPECT_FALSE(subscriptions_.empty());
  peer.send(RawPeer::message(std::string("\0a", 2)));
  note();
  EXPECT_FALSE(subscriptions_.empty());
  peer.send(RawPeer::message(std::string("\0b", 2)));
  note();
  EXPECT_TRUE(subscriptions_.empty());
}

TEST_F(SubscriptionsTest, ACancellationEndsNoOthersSubscription) {
  RawPeer one(bound_[0], "SUB"), other(bound_[0], "SUB");
  one.send(RawPeer::message("\1a"));
  note();
  other.send(RawPeer::message(std::string("\0a", 2)));
  note();
  EXPECT_FALSE(subscriptions_.empty());
}

TEST_F(SubscriptionsTest, AConnectionThatEndsHasNone) {
  RawPeer stays(bound_[0], "SUB");
  {
    RawPeer goes(bound_[0], "SUB");
    for (int i = 0; i < 2; ++i) goes.send(RawPeer::message("\1a"));
    for (int i = 0; i < 2; ++i) note();
    EXPECT_FALSE(subscriptions_.empty());
  }
  note();  // the cancellation that ZeroMQ makes
  EXPECT_TRUE(subscriptions_.empty());
  stays.send(RawPeer::message("\1a"));
  note();
  EXPECT_FALSE(subscriptions_.empty());
}

TEST_F(SubscriptionsTest, AConnectionThatHasEndedBeforeItsSubscriptionWasReceivedHasNone) {
  {
    RawPeer goes(bound_[0], "SUB");
    goes.send(RawPeer::message("\1a"));
    zmq_pollitem_t item = readable(publisher_);
    ASSERT_EQ(zmq_poll(&item, 1, 5000), 1);
  }
  RawPeer other(bound_[0], "SUB");  // may have its descriptor
  zmq::message_t message;
  for (bool hasEnded = false; !hasEnded;) {
    ASSERT_TRUE(publisher_.recv(message));
    hasEnded = message.to_string_view().starts_with('\0');
    subscriptions_.note(message);
  }
  EXPECT_TRUE(subscriptions_.empty());
  other.send(RawPeer::message("\1a"));
  note();
  EXPECT_FALSE(subscriptions_.empty()) << "its own";
}

TEST_F(SubscriptionsTest, ADescriptorOfAnEndedConnectionIsTheNextOnes) {
  zmq::message_t subscription, cancellation;
  {
    RawPeer goes(bound_[0], "SUB");
    goes.send(RawPeer::message("\1a"));
    ASSERT_TRUE(publisher_.recv(subscription));
  }
  ASSERT_TRUE(publisher_.recv(cancellation));
  subscriptions_.note(subscription);
  subscriptions_.note(cancellation);
  EXPECT_TRUE(subscriptions_.empty());
  RawPeer next(bound_[0], "SUB");
  next.send(RawPeer::message("\1a"));
  note();
  EXPECT_FALSE(subscriptions_.empty());
}

TEST_F(SubscriptionsTest, OneThatSubscribedAgainAndAgainBeforeItEndedEndsOnce) {
  std::deque<zmq::message_t> messages(5);
  {
    RawPeer goes(bound_[0], "SUB");
    for (const auto& text : {std::string("\1a"), std::string("\1a"), std::string("\0a", 2), std::string("\1a")})
      goes.send(RawPeer::message(text));
    for (int i = 0; i < 4; ++i) ASSERT_TRUE(publisher_.recv(messages[i]));
  }
  ASSERT_TRUE(publisher_.recv(messages[4]));  // its end
  for (zmq::message_t& message : messages) subscriptions_.note(message);
  EXPECT_TRUE(subscriptions_.empty());
  RawPeer next(bound_[0], "SUB");
  next.send(RawPeer::message("\1a"));
  note();
  EXPECT_FALSE(subscriptions_.empty());
  noteEnd();
  EXPECT_TRUE(subscriptions_.empty());
}

TEST_F(SubscriptionsTest, ARepeatedSubscriptionIsNotThatOfAConnectionOfAnotherSocket) {
  zmq::socket_t other(context_, zmq::socket_type::router);
  guard(other, 8, 512);
  const std::vector<std::string> bound = *bind(other, {"tcp://127.0.0.1:*"});
  std::array<zmq::message_t, 2> messages;
  {
    RawPeer goes(bound_[0], "SUB");
    goes.send(RawPeer::message("\1a"));
    note();
    goes.send(RawPeer::message("\1a"));
    ASSERT_TRUE(publisher_.recv(messages[0]));
  }
  ASSERT_TRUE(publisher_.recv(messages[1]));  // its end
  const RawPeer next(bound[0], "DEALER");     // may have its descriptor
  for (zmq::message_t& message : messages) subscriptions_.note(message);
  EXPECT_TRUE(subscriptions_.empty());
  release(bound);
}

TEST_F(SubscriptionsTest, AnEndThatIsToldBeforeTheDescriptorIsClosedTakesNoSubscriptionOfTheNextOne) {
  {
    RawPeer goes(bound_[0], "SUB");
    goes.send(RawPeer::message("\1a"));
    note();
    noteEnd();
    EXPECT_TRUE(subscriptions_.empty());
  }
  zmq::message_t itsOwn;
  ASSERT_TRUE(publisher_.recv(itsOwn));  // the descriptor is about to be closed
  RawPeer next(bound_[0], "SUB");
  next.send(RawPeer::message("\1a"));
  note();
  EXPECT_FALSE(subscriptions_.empty());
}

TEST_F(SubscriptionsTest, AnEndThatIsToldAfterTheDescriptorIsReusedTakesNoSubscriptionOfTheNextOne) {
  std::array<zmq::message_t, 3> messages;
  {
    RawPeer goes(bound_[0], "SUB");
    goes.send(RawPeer::message("\1a"));
    ASSERT_TRUE(publisher_.recv(messages[0]));
  }
  ASSERT_TRUE(publisher_.recv(messages[2]));  // its end
  const int fd = sourceOf(messages[0]);
  ASSERT_TRUE(test::eventually([&] { return !isConnectionTo(fd, bound_); }));
  std::deque<RawPeer> others;
  do {  // the lowest free descriptor is the next one's
    others.emplace_back(bound_[0], "SUB").send(RawPeer::message("\1a"));
    ASSERT_TRUE(publisher_.recv(messages[1]));
  } while (sourceOf(messages[1]) != fd && others.size() < 100);
  ASSERT_EQ(sourceOf(messages[1]), fd);
  for (zmq::message_t& message : messages) {
    subscriptions_.note(message);
    EXPECT_FALSE(subscriptions_.empty());
  }
  noteEnd();
  EXPECT_TRUE(subscriptions_.empty());
}

TEST_F(SubscriptionsTest, EndedConnectionsAreForgottenBesideOneThatStays) {
  RawPeer stays(bound_[0], "SUB");
  stays.send(RawPeer::message("\1a"));
  note();
  for (int i = 0; i < 20; ++i) {
    {
      RawPeer goes(bound_[0], "SUB");
      goes.send(RawPeer::message("\1a"));
      note();
    }
    note();                                // its end
    EXPECT_LE(subscriptions_.kept(), 4U);  // a descriptor may be closed only after the next one is accepted
  }
  EXPECT_FALSE(subscriptions_.empty());
}

/// Peers do what they may, before the publisher receives anything of it.
TEST_F(SubscriptionsTest, AreThoseOfThePeersThatAreThereWhateverTheyDidBefore) {
  std::mt19937 chance(test::seed());
  std::map<int, RawPeer> peers;
  std::set<int> subscribed;
  const std::string subscription = RawPeer::message("\1a"), cancellation = RawPeer::message(std::string("\0a", 2));
  const auto isAsExpected = [&] {
    zmq::message_t message;
    while (publisher_.recv(message, zmq::recv_flags::dontwait)) {
      settleSubscription(message, true);
      subscriptions_.note(message);
    }
    inflow::releaseEnded(Charge::kSubscriptions);
    return subscriptions_.empty() == subscribed.empty();
  };
  for (int round = 0; round < 300; ++round) {
    for (auto steps = chance() % 12; steps > 0; --steps) {
      const int who = static_cast<int>(chance() % 5);
      const auto one = peers.find(who);
      const auto what = chance() % 4;
      if (one == peers.end()) {
        peers.try_emplace(who, bound_[0], "SUB");
      } else if (what == 0) {
        peers.erase(one);
        subscribed.erase(who);
      } else if (what == 1) {
        one->second.send(cancellation);
        subscribed.erase(who);
      } else {
        one->second.send(what == 2 ? subscription : subscription + subscription);
        subscribed.insert(who);
      }
    }
    ASSERT_TRUE(test::eventually(isAsExpected)) << "round " << round << ", " << subscribed.size() << " subscribed";
  }
  peers.clear();
  subscribed.clear();
  EXPECT_TRUE(test::eventually(isAsExpected));
}

}  // namespace
}  // namespace tractiond::network
