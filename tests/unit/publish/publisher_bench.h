// A publisher, and subscribers that know nothing of it.
#pragma once

#include "daemon/publish/publisher.h"
#include "tests/unit/publish/support.h"
#include "traction/v1/status.pb.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace tractiond::publish::publisher_test {

namespace pb = traction::v1;
using namespace std::chrono_literals;

inline const std::string kRoot = "traction/v1/gel-1/";

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

}  // namespace tractiond::publish::publisher_test
