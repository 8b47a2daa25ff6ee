// The relay between an instrument and peers that the test plays, under a clock that it moves.

#include "gateway/relay.h"
#include "proto/traction/v1/endpoints.h"
#include "tests/support/captured_log.h"
#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstring>

namespace tractiond::gateway::relay_test {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
const std::string kField = "traction/v1/gel/field/", kDescription = "traction/v1/gel/description/";

std::atomic<std::int64_t> time_ns{0};

class RelayTest : public testing::Test {
 protected:
  RelayTest() {
    time_ns = 100 * kSecond_ns;
    std::filesystem::create_directories(folder_);
    const traction::Endpoints endpoints = traction::ipcEndpoints(folder_);
    for (zmq::socket_t* socket : {&stream_, &latest_}) socket->set(zmq::sockopt::linger, 0);
    stream_.set(zmq::sockopt::sndhwm, 0);
    stream_.bind(endpoints.stream);
    latest_.set(zmq::sockopt::xpub_verbose, true);  // each subscription can be read
    latest_.bind(endpoints.latest);
    Config config;
    config.insecure = true;
    config.stream = config.latest = config.control = config.preview = {"tcp://127.0.0.1:*"};
    config.highWaterMark = 100'000;  // nothing is lost, however slowly a thread of ZeroMQ gets on
    auto opened = Relay::open(config, folder_, [] { return time_ns.load(); });
    if (!opened) throw std::runtime_error(opened.error().message());
    relay_ = *std::move(opened);
  }
  ~RelayTest() override { relay_.reset(); }

  /// Lets the relay work until `done`, which does not wait.
  template <typename Done>
  void turnUntil(Done done) {
    ASSERT_TRUE(test::eventually([&] {
      EXPECT_TRUE(relay_->turn(1ms));
      return done();
    }));
  }

  /// Returns the parts of a message that has come to a socket; none: there is none.
  static std::vector<std::string> take(zmq::socket_t& socket) {
    std::vector<std::string> parts;
    zmq::message_t part;
    do {
      if (!socket.recv(part, zmq::recv_flags::dontwait)) break;
      parts.push_back(part.to_string());
    } while (part.more());
    return parts;
  }

  void publish(const std::string& topic, const std::string& payload) {
    stream_.send(zmq::buffer(topic), zmq::send_flags::sndmore);
    stream_.send(zmq::buffer(payload), zmq::send_flags::sndmore);
    stream_.send(zmq::str_buffer("0.0"));
  }

  zmq::socket_t subscriber() {
    zmq::socket_t socket(context_, zmq::socket_type::sub);
    socket.set(zmq::sockopt::linger, 0);
    socket.set(zmq::sockopt::rcvhwm, 0);
    socket.connect(relay_->bound(kStream).at(0));
    socket.set(zmq::sockopt::subscribe, "traction/");
    return socket;
  }

  /// Publishes fields until one has come to the subscriber. Returns the topics that came before it.
  std::vector<std::string> topicsBeforeAField(zmq::socket_t& subscriber) {
    std::vector<std::string> topics;
    turnUntil([&] {
      publish(kField, std::to_string(++fields_));
      const auto parts = take(subscriber);
      if (parts.empty()) return false;
      if (parts[0] == kField) return true;
      topics.push_back(parts[0]);
      return false;
    });
    return topics;
  }

  /// Returns the topic of the next message that is no field.
  std::string nextBesideFields(zmq::socket_t& subscriber) {
    std::string topic;
    turnUntil([&] {
      for (auto parts = take(subscriber); topic.empty() && !parts.empty(); parts = take(subscriber)) {
        if (parts[0] != kField) topic = parts[0];
      }
      return !topic.empty();
    });
    return topic;
  }

  /// Waits until a field published from now on has come to the subscriber. Returns whether only fields came until then.
  bool onlyFieldsCome(zmq::socket_t& subscriber) {
    const std::string last = std::to_string(++fields_);
    publish(kField, last);
    bool only = true;
    turnUntil([&] {
      for (auto parts = take(subscriber); !parts.empty(); parts = take(subscriber)) {
        only = only && parts[0] == kField;
        if (parts[1] == last) return true;
      }
      return false;
    });
    return only;
  }

  const test::TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path() / "tractiond" / "gel";
  const test::CapturedLog log_;
  int fields_ = 0;
  zmq::context_t context_;
  zmq::socket_t stream_{context_, zmq::socket_type::xpub}, latest_{context_, zmq::socket_type::xpub};
  std::unique_ptr<Relay> relay_;
};

TEST_F(RelayTest, PassesTheContactsOfTheTractionTouchBesideTheInstrument) {
  const std::filesystem::path beside = temporary_.path() / "traction-touch" / "gel";
  std::filesystem::create_directories(beside);
  zmq::socket_t touch(context_, zmq::socket_type::pub);
  touch.set(zmq::sockopt::linger, 0);
  touch.bind(traction::ipcEndpoints(beside).stream);
  zmq::socket_t peer = subscriber();
  std::vector<std::string> parts;
  turnUntil([&] {
    touch.send(zmq::str_buffer("traction/v1/gel/contacts/"), zmq::send_flags::sndmore);
    touch.send(zmq::str_buffer("contacts"), zmq::send_flags::sndmore);
    touch.send(zmq::str_buffer("1.0"));
    parts = take(peer);
    return !parts.empty();
  });
  EXPECT_EQ(parts, (std::vector<std::string>{"traction/v1/gel/contacts/", "contacts", "1.0"}));
}

TEST_F(RelayTest, NewSubscribersAreToldTheDescriptionAtMostTenTimesASecond) {
  zmq::socket_t first = subscriber();
  topicsBeforeAField(first);
  publish(kDescription, "what its numbers mean");
  EXPECT_EQ(nextBesideFields(first), kDescription);

  zmq::socket_t second = subscriber();
  EXPECT_EQ(nextBesideFields(second), kDescription) << "at once, as the last time is long ago";
  EXPECT_EQ(nextBesideFields(first), kDescription) << "all are told";

  zmq::socket_t third = subscriber();
  ASSERT_TRUE(topicsBeforeAField(third).empty());
  time_ns += 99'999'999;
  ASSERT_TRUE(onlyFieldsCome(third));
  time_ns += 1;
  EXPECT_EQ(nextBesideFields(third), kDescription);
}

TEST_F(RelayTest, LatestIsSubscribedToAgainAfterASecondWithoutAField) {
  const auto isSubscribed = [&] { return !take(latest_).empty(); };
  turnUntil(isSubscribed);
  const auto turns = [&] {
    bool again = false;
    for (int i = 0; i < 20; ++i) {
      EXPECT_TRUE(relay_->turn(1ms));
      again = again || isSubscribed();
    }
    return again;
  };
  for (int i = 0; i < 3; ++i) {
    time_ns += kSecond_ns - 1;
    EXPECT_FALSE(turns());
    time_ns += 1 + kSecond_ns / 4;
    turnUntil(isSubscribed);
  }
  zmq::socket_t subscriber(context_, zmq::socket_type::sub);
  subscriber.set(zmq::sockopt::linger, 0);
  subscriber.connect(relay_->bound(kLatest).at(0));
  subscriber.set(zmq::sockopt::subscribe, "");
  turnUntil([&] {
    latest_.send(zmq::str_buffer("\x09"));
    return !take(subscriber).empty();
  });
  for (int i = 0; i < 8; ++i) {
    time_ns += kSecond_ns / 2;
    latest_.send(zmq::str_buffer("\x09"));
    turnUntil([&] { return !take(subscriber).empty(); });
    EXPECT_FALSE(isSubscribed());
  }
}

// ZeroMQ 4.3.4 aborts the process when a message in parts reaches a socket with ZMQ_CONFLATE.
TEST_F(RelayTest, LatestOfManyPartsIsSkippedAndTheNextOneIsPassedOn) {
  turnUntil([&] { return !take(latest_).empty(); });
  zmq::socket_t subscriber(context_, zmq::socket_type::sub);
  subscriber.set(zmq::sockopt::linger, 0);
  subscriber.connect(relay_->bound(kLatest).at(0));
  subscriber.set(zmq::sockopt::subscribe, "");
  std::vector<std::string> parts;
  turnUntil([&] {
    for (int i = 0; i < 300; ++i) {
      latest_.send(zmq::str_buffer("\x09 in parts"), i < 299 ? zmq::send_flags::sndmore : zmq::send_flags::none);
    }
    latest_.send(zmq::str_buffer("\x09 whole"));
    parts = take(subscriber);
    return !parts.empty();
  });
  EXPECT_EQ(parts, std::vector<std::string>{"\x09 whole"});
}

TEST_F(RelayTest, PreviewsAreAskedForWhileSomebodySubscribesToThem) {
  const std::string preview = "traction/v1/gel/preview/";
  zmq::socket_t reader = subscriber();
  topicsBeforeAField(reader);
  publish(kDescription, "what its numbers mean");
  EXPECT_EQ(nextBesideFields(reader), kDescription);
  const auto isTold = [&](char what) {
    return [&, told = what + preview] {
      const auto parts = take(stream_);
      return !parts.empty() && parts[0] == told;
    };
  };
  zmq::socket_t looker(context_, zmq::socket_type::sub);
  looker.set(zmq::sockopt::linger, 0);
  looker.connect(relay_->bound(kPreview).at(0));
  looker.set(zmq::sockopt::subscribe, preview);
  turnUntil(isTold('\1'));
  turnUntil([&] {
    publish(preview, "a picture");
    return !take(looker).empty();
  });
  EXPECT_TRUE(onlyFieldsCome(reader)) << "who may only read gets none";
  looker.set(zmq::sockopt::unsubscribe, preview);
  turnUntil(isTold('\0'));
}

/// A gateway with a key of its own, whose time stands still, so that its keys are not due to be checked again.
class RelayWithKeys : public testing::Test {
 protected:
  RelayWithKeys() { EXPECT_TRUE(network::saveServerKey(keys_, server_)); }

  auto open() const {
    Config config;
    config.keys = keys_.string();
    config.stream = config.latest = config.control = {"tcp://127.0.0.1:*"};
    return Relay::open(config, folder_.path(), [] { return kSecond_ns; });
  }

  const test::TemporaryFolder folder_;
  const std::filesystem::path keys_ = folder_.path() / "keys";
  const network::KeyPair server_ = network::newKeyPair(), own_ = network::newKeyPair();
};

TEST_F(RelayWithKeys, AppliesAChangeToTheNextConnection) {
  const test::CapturedLog log;
  const auto relay = open();
  ASSERT_TRUE(relay);
  EXPECT_TRUE((*relay)->turn(1ms));
  // Connects with the client's key. Returns the first of these events of the connection.
  const auto firstOf = [&](int events) {
    zmq::context_t context;  // of its own: a monitor's name may stay in use after its socket was closed
    zmq::socket_t peer(context, zmq::socket_type::dealer), event(context, zmq::socket_type::pair);
    for (zmq::socket_t* socket : {&peer, &event}) socket->set(zmq::sockopt::linger, 0);
    peer.set(zmq::sockopt::curve_serverkey, server_.publicKey);
    peer.set(zmq::sockopt::curve_publickey, own_.publicKey);
    peer.set(zmq::sockopt::curve_secretkey, own_.secretKey);
    zmq_socket_monitor(peer.handle(), "inproc://event", events);
    event.connect("inproc://event");
    peer.connect((*relay)->bound(kControl).at(0));
    zmq::message_t message;
    EXPECT_TRUE(test::eventually([&] {
      EXPECT_TRUE((*relay)->turn(1ms));
      return event.recv(message, zmq::recv_flags::dontwait).has_value();
    }));
    zmq_socket_monitor(peer.handle(), nullptr, 0);
    std::uint16_t kind = 0;
    std::memcpy(&kind, message.data(), std::min(message.size(), sizeof kind));
    return int{kind};
  };
  constexpr int kAdmitted = ZMQ_EVENT_HANDSHAKE_SUCCEEDED, kRefused = ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
  EXPECT_EQ(firstOf(kAdmitted | kRefused), kRefused);
  ASSERT_TRUE(network::allow(keys_, {"arm-1", own_.publicKey, network::Permission::kControl}));
  EXPECT_EQ(firstOf(kAdmitted | kRefused), kAdmitted);
  ASSERT_TRUE(network::revoke(keys_, "arm-1"));
  // A gateway that notices it ends all connections, this one perhaps before it is refused.
  EXPECT_NE(firstOf(kAdmitted | kRefused | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL), kAdmitted);
  for (int i = 0; i < 5; ++i) EXPECT_TRUE((*relay)->turn(1ms));
  EXPECT_EQ(log.count("allowed: arm-1"), 1U) << log.text();
  EXPECT_EQ(log.count("a key was taken back"), 1U) << "connections are ended once: " << log.text();
}

TEST_F(RelayTest, AnInstrumentThatIsSilentIsToldOnce) {
  zmq::socket_t reader = subscriber();
  topicsBeforeAField(reader);
  ASSERT_TRUE(onlyFieldsCome(reader));
  const std::string silent = "nothing comes from the instrument", heard = "the instrument is heard again";
  time_ns += 3 * kSecond_ns;
  EXPECT_TRUE(relay_->turn(1ms));
  EXPECT_EQ(log_.count(silent), 0U) << "three seconds are none";
  time_ns += kSecond_ns;
  for (int i = 0; i < 3; ++i, time_ns += kSecond_ns) EXPECT_TRUE(relay_->turn(1ms));
  EXPECT_EQ(log_.count(silent), 1U);
  EXPECT_EQ(log_.count(heard), 0U);
  ASSERT_TRUE(onlyFieldsCome(reader));
  EXPECT_EQ(log_.count(heard), 1U);
}

}  // namespace
}  // namespace tractiond::gateway::relay_test
