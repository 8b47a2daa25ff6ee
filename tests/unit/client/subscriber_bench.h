// The client's Subscriber beside a publisher of the daemon.
#pragma once

#include "tests/unit/publish/support.h"
#include "traction/subscriber.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>

namespace traction::subscriber_test {

using namespace std::chrono_literals;
using tractiond::publish::Description;
using tractiond::publish::idOf;
using tractiond::publish::TestClock;
using tractiond::test::eventually;
using tractiond::test::kHung;

inline constexpr int kMarkerCount = 1152;
inline constexpr int kNodeCount = 576;

/// Options of a subscriber whose time is TestClock's.
inline SubscriberOptions at(const std::string& endpoint, unsigned topics = kAllTopics, Mode mode = Mode::kStream) {
  SubscriberOptions options;
  options.endpoint = endpoint;
  options.topics = topics;
  options.mode = mode;
  options.monotonicClock = TestClock::monotonic;
  return options;
}

/// Receives until the subscriber says that it is `connected`, or not.
inline void expectConnected(Subscriber& subscriber, bool connected) {
  EXPECT_TRUE(eventually([&] {
    TestClock::advance(10ms);
    subscriber.receive(10ms);
    return subscriber.isConnected() == connected;
  }));
}

/// A publisher of `field_`, on a free port.
class SubscriberTest : public testing::Test {
 protected:
  SubscriberTest() { open(tractiond::publish::description()); }

  void open(const Description& description, const std::string& stream = "tcp://127.0.0.1:*") {
    publisher_.reset();
    auto opened = tractiond::publish::Publisher::open(tractiond::publish::options({stream}), description, ledger_, {});
    if (!opened) throw std::runtime_error(opened.error().message());
    publisher_ = *std::move(opened);
    stream_ = publisher_->streamEndpoints().at(0);
    latest_ = publisher_->latestEndpoints().at(0);
  }

  /// Publishes until a message of this kind arrives.
  template <typename Kind>
  Kind await(Subscriber& subscriber) {
    std::optional<Kind> found;
    const bool arrived = eventually([&] {
      TestClock::advance(50ms);
      publisher_->serve(-1, 0ms);
      publisher_->publish(field_);
      while (auto message = subscriber.receive(5ms)) {
        if (auto* kind = std::get_if<Kind>(&*message)) {
          found = std::move(*kind);
          break;
        }
      }
      return found.has_value();
    });
    if (!arrived) throw std::runtime_error("nothing arrived");
    return *std::move(found);
  }

  tractiond::TractionField field_ = tractiond::publish::traction(kMarkerCount, kNodeCount, 70'000);
  tractiond::Ledger ledger_;
  std::unique_ptr<tractiond::publish::Publisher> publisher_;
  std::string stream_, latest_;
};

}  // namespace traction::subscriber_test
