// Messages that no daemon of this version sends.
#include "tests/unit/client/forger.h"

#include <chrono>
#include <thread>

namespace traction::subscriber_test {
namespace {

TEST(Subscriber, GapsOfTheSequenceAreLosses) {
  Forger forger;
  const auto lostAfter = [&](std::uint64_t sequence, char boot = 'b') {
    forger.field(sequence, boot);
    EXPECT_TRUE(forger.subscriber().receive(kHung));
    return forger.subscriber().lost();
  };
  EXPECT_EQ(lostAfter(7), 0U);  // joined late
  EXPECT_EQ(lostAfter(8), 0U);
  EXPECT_EQ(lostAfter(10), 1U);
  EXPECT_EQ(lostAfter(20), 10U);
  EXPECT_EQ(lostAfter(3, 'c'), 10U);  // a new start of the daemon
  EXPECT_EQ(lostAfter(5, 'c'), 11U);
}

TEST(Subscriber, PublisherOfSomethingElseIsTold) {
  Forger forger;
  forger.send({"truth/", "{}"});
  EXPECT_EQ(forger.failure(), ErrorCode::kVersion);
  forger.send({"\1\x1b[2J", "{}"});
  EXPECT_EQ(forger.failure(), ErrorCode::kVersion);
}

TEST(Subscriber, OtherVersionIsTold) {
  Forger forger;
  forger.send({"traction/v2/gel/field/", "", "0.0"});
  EXPECT_EQ(forger.failure(), ErrorCode::kVersion);
}

TEST(Subscriber, MalformedMessagesAreToldAndTheNextIsRead) {
  Forger forger;
  v1::Field field;
  field.mutable_header()->set_boot("short");
  const std::string badId = field.SerializeAsString();
  field.Clear();
  field.add_force_n(1.0F);
  const std::string incompleteVector = field.SerializeAsString();
  field.add_force_n(1.0F);
  field.add_force_n(1.0F);
  const std::string noMask = field.SerializeAsString();
  const std::vector<std::string> bad = {"\xff\xff\xff\xff", badId, incompleteVector, noMask};
  for (const std::string& payload : bad) {
    forger.send({"traction/v1/gel/field/", payload, "0.0"});
    EXPECT_EQ(forger.failure(), ErrorCode::kMalformed);
  }
  forger.send({"traction/v1/gel/field/"});
  EXPECT_EQ(forger.failure(), ErrorCode::kMalformed);
  forger.send({"traction/v1/gel/field/", "", "0.0", "more", "and more"});
  EXPECT_EQ(forger.failure(), std::nullopt);
}

TEST(Subscriber, TopicsOfALaterDaemonArePassedOver) {
  Forger forger;
  for (const std::string topic :
       {"traction/v1/gel/contacts/", "traction/v1/gel", "traction/v1//", "traction/v1/gel/field"}) {
    forger.send({topic, "\xff", "0.0"});
  }
  forger.field(1);
  EXPECT_TRUE(std::holds_alternative<Field>(forger.subscriber().receive(kHung).value()));
  EXPECT_EQ(forger.subscriber().raw().topic, "traction/v1/gel/field/");
  EXPECT_FALSE(forger.subscriber().receive(std::chrono::milliseconds(0)));
  EXPECT_EQ(forger.subscriber().raw().topic, "");
  EXPECT_EQ(forger.subscriber().raw().bytes, "");
}

// The clock is read for each message that arrives: ten more are sent then, so that there always is a next one.
zmq::socket_t* flooding = nullptr;
int readings = 0;
constexpr int kEndOfFlood = 20'000;

std::int64_t flood() {
  if (++readings < kEndOfFlood) {
    for (int i = 0; i < 10; ++i) {
      flooding->send(zmq::str_buffer("traction/v1/gel/contacts/"), zmq::send_flags::sndmore);
      flooding->send(zmq::str_buffer("bytes"));
    }
    for (int i = 0; i < 100; ++i) std::this_thread::yield();  // ZeroMQ's threads pass them on
  }
  return 0;
}

TEST(Subscriber, ReturnsInTimeWhileOtherTopicsComeWithoutEnd) {
  zmq::context_t context;
  zmq::socket_t publisher(context, zmq::socket_type::xpub);
  publisher.set(zmq::sockopt::linger, 0);
  publisher.bind("tcp://127.0.0.1:*");
  SubscriberOptions options = at(publisher.get(zmq::sockopt::last_endpoint));
  options.monotonicClock = flood;
  Subscriber subscriber(options);
  zmq::message_t subscription;
  ASSERT_TRUE(publisher.recv(subscription));
  flooding = &publisher;
  flood();
  EXPECT_FALSE(subscriber.receive(std::chrono::milliseconds(10)));
  EXPECT_LT(readings, kEndOfFlood);
}

}  // namespace
}  // namespace traction::subscriber_test
