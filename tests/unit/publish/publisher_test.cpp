#include "daemon/publish/publisher.h"
#include "proto/traction/v1/endpoints.h"
#include "tests/unit/publish/support.h"
#include "traction/v1/description.pb.h"
#include "traction/v1/field.pb.h"
#include "traction/v1/markers.pb.h"
#include "traction/v1/preview.pb.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <memory>
#include <string>

namespace tractiond::publish::publisher_test {
namespace {

namespace pb = traction::v1;
using namespace std::chrono_literals;

const std::string kRoot = "traction/v1/gel-1/";

/// A publisher, and subscribers that know nothing of it.
class PublisherTest : public testing::Test {
 protected:
  void open(const PublishOptions& given = options()) {
    auto opened = Publisher::open(given, description(), ledger_, [](pb::Status& status) {
      status.set_camera(pb::CAMERA_STATE_STREAMING);
      status.mutable_turns()->set_control(5);
    });
    ASSERT_TRUE(opened) << opened.error().message();
    publisher_ = *std::move(opened);
    stream_ = publisher_->streamEndpoints().at(0);
    latest_ = publisher_->latestEndpoints().at(0);
  }

  /// Serves until something has arrived. Descriptions are rate-limited: time goes on.
  Parts pump(TestSubscriber& subscriber) {
    Parts parts;
    EXPECT_TRUE(test::eventually([&] {
      TestClock::advance(10ms);
      publisher_->serve(-1, 10ms);
      parts = subscriber.receive(0);
      return !parts.topic.empty();
    })) << "nothing arrived";
    return parts;
  }

  /// A subscriber whose subscriptions have arrived.
  std::unique_ptr<TestSubscriber> join(const std::string& topic, int highWaterMark = 1000) {
    auto subscriber = std::make_unique<TestSubscriber>(stream_, topic, highWaterMark);
    subscriber->socket().set(zmq::sockopt::subscribe, kRoot + "description/");
    while (pump(*subscriber).topic != kRoot + "description/") {
    }
    subscriber->socket().set(zmq::sockopt::unsubscribe, kRoot + "description/");
    return subscriber;
  }

  template <typename Message>
  Message parse(const Parts& parts) {
    Message message;
    EXPECT_TRUE(message.ParseFromString(parts.payload));
    return message;
  }

  TractionField field_ = traction(kMarkers, kNodes);
  Ledger ledger_;
  std::unique_ptr<Publisher> publisher_;
  std::string stream_, latest_;
};

TEST(Topics, NamesAreOfPlainCharacters) {
  for (const std::string name : {"a", "gel-1", "GEL_2", "123456789012345678901234"}) {
    EXPECT_TRUE(traction::isValidName(name)) << name;
  }
  for (const std::string name : {"", "a/b", "a b", "ä", "a.b", "1234567890123456789012345", "..", "a\n"}) {
    EXPECT_FALSE(traction::isValidName(name)) << name;
  }
}

TEST_F(PublisherTest, MessageHasTopicPayloadAndTime) {
  open();
  const auto subscriber = join("traction/v1/");
  publisher_->publish(field_);
  const Parts field = subscriber->receive();
  EXPECT_EQ(field.topic, kRoot + "field/");
  EXPECT_EQ(field.time, "1700000000.000000001");
  EXPECT_EQ(parse<pb::Field>(field).header().sequence(), 1U);
  const Parts markers = subscriber->receive();
  EXPECT_EQ(markers.topic, kRoot + "markers/");
  EXPECT_EQ(markers.time, "1700000000.000000001");
  EXPECT_EQ(parse<pb::Markers>(markers).header().flags(), kZeroUnverified | kReacquiring);
}

TEST_F(PublisherTest, NewSubscriberOfAnyMatchingPrefixGetsTheDescription) {
  open();
  for (const std::string topic : {"", "traction/", "traction/v1/gel-1/", "traction/v1/gel-1/description/"}) {
    TestSubscriber subscriber(stream_, topic);
    Parts parts;
    do parts = pump(subscriber);
    while (parts.topic != kRoot + "description/" && !HasFailure());
    const auto message = parse<pb::Description>(parts);
    EXPECT_EQ(message.camera().serial(), "42");
    EXPECT_EQ(message.topics_size(), 5);
  }
}

TEST_F(PublisherTest, NewDescriptionIsSentWithoutBeingAskedFor) {
  open();
  const auto subscriber = join(kRoot + "description/");
  Description changed = description();
  changed.message.mutable_camera()->set_serial("43");
  changed.identity.sensor = "another";  // fixed for life
  publisher_->describe(changed);
  const Parts parts = pump(*subscriber);
  EXPECT_EQ(parts.topic, kRoot + "description/");
  EXPECT_EQ(parse<pb::Description>(parts).camera().serial(), "43");
  EXPECT_EQ(parse<pb::Description>(parts).header().sensor(), "gel-1");
  pb::Description last;
  ASSERT_TRUE(last.ParseFromString(publisher_->lastDescription()));
  EXPECT_EQ(last.camera().serial(), "43");
  EXPECT_GT(last.header().sent_ns(), 0);
}

TEST_F(PublisherTest, DescriptionsAreNotSentMoreOftenThanTheInterval) {
  open();
  const auto witness = join(kRoot + "description/");
  std::vector<std::unique_ptr<TestSubscriber>> others;
  for (int i = 0; i < 50; ++i) {  // time stands still
    others.push_back(std::make_unique<TestSubscriber>(stream_, ""));
    publisher_->serve(-1, 10ms);
  }
  EXPECT_TRUE(witness->receive(0).topic.empty());
  TestClock::advance(100ms);
  Parts parts;
  EXPECT_TRUE(test::eventually([&] {  // as soon as one of the subscriptions has arrived
    publisher_->serve(-1, 10ms);
    parts = witness->receive(0);
    return !parts.topic.empty();
  }));
  EXPECT_EQ(parts.topic, kRoot + "description/");
  EXPECT_TRUE(witness->receive(0).topic.empty());
}

TEST_F(PublisherTest, StatusComesOnceASecondWithAndWithoutFields) {
  open();
  const auto subscriber = join(kRoot + "status/");
  const auto status = [&] { return parse<pb::Status>(subscriber->receive()); };
  TestClock::advance(1000ms);
  publisher_->serve(-1, 0ms);
  const auto first = status();

  ledger_.received.add(30);
  ledger_.published.add(30);
  for (int i = 0; i < 30; ++i) {
    field_.residual_px = i % 2 == 0 ? 0.1 : 0.7;
    publisher_->publish(field_);
  }
  field_.residual_px = 0.5;
  TestClock::advance(999ms);
  publisher_->serve(-1, 0ms);
  EXPECT_TRUE(subscriber->receive(0).topic.empty());
  TestClock::advance(1ms);
  publisher_->publish(field_);
  const auto second = status();
  EXPECT_EQ(second.header().sequence(), first.header().sequence() + 1);
  EXPECT_EQ(second.header().frame_number(), 1U);
  EXPECT_EQ(second.camera(), pb::CAMERA_STATE_STREAMING);
  EXPECT_EQ(second.turns().control(), 5U);
  EXPECT_DOUBLE_EQ(second.rates().received_hz(), 30.0);
  EXPECT_DOUBLE_EQ(second.rates().published_hz(), 31.0);
  EXPECT_DOUBLE_EQ(second.latencies().track().p50_s(), 200e-6);
  EXPECT_DOUBLE_EQ(second.latencies().solve().p99_s(), 150e-6);
  EXPECT_GE(second.uptime_s(), 2.0);
  EXPECT_NEAR(second.residual_px(), 0.5, 1e-6);  // the root of the mean of their squares

  TestClock::advance(1000ms);
  publisher_->serve(-1, 0ms);
  const auto third = status();
  EXPECT_EQ(third.latencies().total().max_s(), 0.0);
  EXPECT_EQ(third.rates().published_hz(), 0.0);
  EXPECT_EQ(third.residual_px(), 0.0);
  pb::Status last;
  ASSERT_TRUE(last.ParseFromString(publisher_->lastStatus()));
  EXPECT_EQ(last.header().sequence(), third.header().sequence());
}

TEST_F(PublisherTest, StatusSumsTheWorkOfTheSolver) {
  open();
  const auto subscriber = join(kRoot + "status/");
  const auto solving = [&] {
    TestClock::advance(1000ms);
    publisher_->serve(-1, 0ms);
    return parse<pb::Status>(subscriber->receive()).solving();
  };
  EXPECT_EQ(solving().contact(), 0U);
  field_.method = Method::kContact;
  field_.work = {.rounds = 3, .atoms = 40, .patchShare = 0.6, .evenShare = 0.3, .failed = false};
  publisher_->publish(field_);
  field_.work = {.rounds = 2, .atoms = 5, .patchShare = 0.1, .evenShare = 0.9, .failed = false};
  publisher_->publish(field_);
  field_.method = Method::kNone;
  field_.work = {.rounds = 1, .atoms = 0, .patchShare = 0.0, .evenShare = 0.0, .failed = true};
  publisher_->publish(field_);
  for (int i = 0; i < 2; ++i) {
    const pb::Solving sums = solving();
    EXPECT_EQ(sums.contact(), 2U);
    EXPECT_EQ(sums.patches(), 1U);
    EXPECT_EQ(sums.even(), 1U);
    EXPECT_EQ(sums.rounds(), 6U);
    EXPECT_EQ(sums.atoms(), 45U);
    EXPECT_EQ(sums.failed(), 1U);
  }
}

/// Of 2 x 1 pixels.
Preview preview(std::uint64_t frame) {
  return {.picture = {2, 1, 3, {1, 2, 3, 4, 5, 6}},
          .factor = 4,
          .info = frameInfo(frame),
          .flags = kTorn,
          .zero = idOf(100)};
}

TEST_F(PublisherTest, PreviewIsSentWithWhereItLies) {
  open();
  const auto subscriber = join(kRoot + "preview/");
  ASSERT_TRUE(publisher_->previewWanted());
  for (std::uint64_t frame = 7; frame < 9; ++frame) {
    ASSERT_TRUE(publisher_->offerPreview(preview(frame)));
    EXPECT_FALSE(publisher_->offerPreview(preview(frame))) << "that before has not been sent";
    publisher_->serve(-1, 0ms);
    const Parts parts = subscriber->receive();
    EXPECT_EQ(parts.topic, kRoot + "preview/");
    const auto message = parse<pb::Preview>(parts);
    EXPECT_EQ(message.header().sequence(), frame - 6);
    EXPECT_EQ(message.header().frame_number(), frame);
    EXPECT_EQ(message.width(), 2U);
    EXPECT_EQ(message.height(), 1U);
    EXPECT_EQ(message.format(), pb::PREVIEW_FORMAT_RGB8);
    EXPECT_EQ(message.pixels(), "\1\2\3\4\5\6");
    EXPECT_EQ(message.scale(), 4.0);
    EXPECT_EQ(message.origin_px().x(), 1.5);
    EXPECT_EQ(message.origin_px().y(), 1.5);
  }
}

TEST_F(PublisherTest, PreviewsAreWantedAsLongAsASubscriptionNamesThem) {
  open();
  const auto everything = join("");
  const auto sensor = join(kRoot);
  const auto fields = join(kRoot + "field/");
  EXPECT_FALSE(publisher_->previewWanted());
  const auto soon = [&](bool wanted) {
    EXPECT_TRUE(test::eventually([&] {
      publisher_->serve(-1, 10ms);
      return publisher_->previewWanted() == wanted;
    }));
  };
  auto one = std::make_unique<TestSubscriber>(stream_, kRoot + "preview/");
  auto same = std::make_unique<TestSubscriber>(stream_, kRoot + "preview/");
  soon(true);
  auto shorter = std::make_unique<TestSubscriber>(stream_, kRoot + "p");
  // Served until all their subscriptions are known.
  for (bool got = false; !got;) {
    publisher_->offerPreview(preview(1));
    publisher_->serve(-1, 1ms);
    got = !shorter->receive(1).topic.empty();
  }
  one.reset();
  same.reset();
  for (int i = 0; i < 20; ++i) publisher_->serve(-1, 10ms);
  EXPECT_TRUE(publisher_->previewWanted());
  shorter->socket().set(zmq::sockopt::unsubscribe, kRoot + "p");
  soon(false);
  TestSubscriber again(stream_, kRoot + "preview");
  soon(true);
}

TEST_F(PublisherTest, StalledSubscriberLosesVisiblyAndNobodyElseDoes) {
  PublishOptions small = options();
  small.highWaterMark = 4;
  open(small);
  const auto stalled = join(kRoot + "field/", 4);
  const auto reader = join(kRoot + "field/");
  constexpr std::uint64_t kCount = 3000;  // 24 MB: more than the kernel buffers
  for (std::uint64_t i = 1; i <= kCount; ++i) {
    publisher_->publish(field_);
    ASSERT_EQ(parse<pb::Field>(reader->receive()).header().sequence(), i);
  }
  std::uint64_t received = 0, lost = 0, before = 0;
  std::uint64_t published = kCount;
  while (before != published) {  // until it has caught up
    const Parts parts = stalled->receive(50);
    if (parts.topic.empty()) {
      publisher_->publish(field_);
      ++published;
      continue;
    }
    const std::uint64_t sequence = parse<pb::Field>(parts).header().sequence();
    lost += sequence - before - 1;
    before = sequence;
    ++received;
  }
  EXPECT_GT(lost, 0U);
  EXPECT_EQ(received + lost, published);
}

TEST_F(PublisherTest, LatestKeepsTheNewestForAStalledReader) {
  open();
  TestSubscriber reader(latest_, "", 1);
  std::uint64_t published = 0;
  Parts parts;
  while (parts.topic.empty() && published < 100'000) {  // until its subscription has arrived
    publisher_->publish(field_);
    ++published;
    parts = reader.receive(1);
  }
  for (; published < 3000; ++published) publisher_->publish(field_);
  pb::Field message;
  std::uint64_t received = 0;
  while (message.header().sequence() != published) {
    parts = reader.receive();
    ASSERT_FALSE(parts.topic.empty()) << "the newest never came";
    ASSERT_TRUE(message.ParseFromString(parts.topic));  // a single part: the payload
    EXPECT_TRUE(parts.payload.empty());
    ++received;
  }
  EXPECT_LT(received, published);
}

}  // namespace
}  // namespace tractiond::publish::publisher_test
