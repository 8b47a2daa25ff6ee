// Subscribers whose publisher is another one, goes, comes back, or never was there.
#include "tests/support/deadline.h"
#include "tests/support/temporary_folder.h"
#include "traction/subscriber.h"
#include "traction/v1/field.pb.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <zmq.hpp>

#include <filesystem>
#include <string>
#include <thread>

namespace traction::subscriber_test {
namespace {

using namespace std::chrono_literals;
using tractiond::test::eventually;
using tractiond::test::kHung;
using tractiond::test::kHung_ms;

std::chrono::nanoseconds testClock{0};  // NOLINT: the clock of a program is one, too

/// Options of a subscriber whose time is `testClock`.
SubscriberOptions at(const std::string& endpoint, unsigned topics = kAllTopics, Mode mode = Mode::kStream) {
  SubscriberOptions options;
  options.endpoint = endpoint;
  options.topics = topics;
  options.mode = mode;
  options.monotonicClock = [] { return std::int64_t{testClock.count()}; };
  return options;
}

/// Returns a socket that listens at a path.
int listenAt(const std::string& path) {
  std::filesystem::remove(path);  // ZeroMQ leaves it there
  const int listener = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  const auto* any = reinterpret_cast<const sockaddr*>(&address);
  if (bind(listener, any, sizeof address) != 0 || listen(listener, 8) != 0) throw std::runtime_error("no socket");
  return listener;
}

v1::Field numbered(std::uint64_t sequence) {
  v1::Field field;
  field.set_timestamp(1.0);
  field.mutable_header()->set_sequence(sequence);
  return field;
}

/// A folder for a socket, whose name nobody else can take meanwhile as they could a port.
class SocketTest : public testing::Test {
 protected:
  /// Binds the publisher, and returns a subscriber that it knows of.
  Subscriber subscribed(Mode mode) {
    publisher_.set(zmq::sockopt::sndhwm, 0);
    publisher_.bind(endpoint_);
    Subscriber subscriber(at(endpoint_, kField, mode));
    zmq::message_t subscription;
    EXPECT_TRUE(publisher_.recv(subscription));
    return subscriber;
  }
  void send(const std::string& part, bool isLast = true) {
    publisher_.send(zmq::buffer(part), isLast ? zmq::send_flags::none : zmq::send_flags::sndmore);
  }

  const tractiond::test::TemporaryFolder folder_;
  const std::string path_ = folder_.path() / "stream", endpoint_ = "ipc://" + path_;
  zmq::context_t context_;
  zmq::socket_t publisher_{context_, zmq::socket_type::xpub};
};

TEST_F(SocketTest, SubscriptionThatThePublisherLostIsSentAgainUntilAMessageArrives) {
  v1::Field field;
  field.set_timestamp(1.0);
  for (const Mode mode : {Mode::kLatest, Mode::kStream}) {
    zmq::context_t context;
    zmq::socket_t publisher(context, zmq::socket_type::xpub);
    publisher.set(zmq::sockopt::xpub_manual, 1);  // a subscription has no effect until this test accepts it
    publisher.set(zmq::sockopt::linger, 0);
    publisher.bind(endpoint_);
    Subscriber subscriber(at(endpoint_, kField, mode));
    int subscriptions = 0;
    const auto turn = [&] {
      subscriber.receive(1ms);
      for (zmq::message_t one; publisher.recv(one, zmq::recv_flags::dontwait);) ++subscriptions;
    };
    const auto expectSubscriptions = [&](int expected) {
      ASSERT_TRUE(eventually([&] {
        turn();
        return subscriber.isConnected() && subscriptions == expected;
      }));
      for (int i = 0; i < 20; ++i) turn();
      EXPECT_EQ(subscriptions, expected) << "as long as time stands still";
    };
    expectSubscriptions(1);
    for (int expected = 2; expected < 5; ++expected) {
      testClock += 1s;
      expectSubscriptions(expected);
    }
    publisher.set(zmq::sockopt::subscribe, mode == Mode::kLatest ? "\x09" : "");
    if (mode == Mode::kStream) publisher.send(zmq::str_buffer("traction/v1/gel/field/"), zmq::send_flags::sndmore);
    publisher.send(zmq::buffer(field.SerializeAsString()));
    EXPECT_TRUE(subscriber.receive(kHung));
    for (int i = 0; i < 20; ++i) {
      testClock += 1s;
      turn();
    }
    EXPECT_EQ(subscriptions, 4);
  }
}

// ZeroMQ 4.3.4 aborts the process when a message in parts reaches a socket with ZMQ_CONFLATE.
TEST_F(SocketTest, LatestOfManyPartsIsMalformedAndTheNextOneIsRead) {
  Subscriber subscriber = subscribed(Mode::kLatest);
  for (int i = 0; i < 300; ++i) send(numbered(1).SerializeAsString(), i == 299);
  try {
    subscriber.receive(kHung);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMalformed) << error.what();
  }
  send(numbered(2).SerializeAsString());
  const auto message = subscriber.receive(kHung);
  ASSERT_TRUE(message);
  EXPECT_EQ(std::get<Field>(*message).header.sequence, 2U);
}

TEST_F(SocketTest, LatestIsTheNewestHoweverManyWait) {
  Subscriber subscriber = subscribed(Mode::kLatest);
  std::uint64_t sent = 0;
  for (const int waiting : {1, 2, 499, 1000, 5000}) {  // the last more than the queue holds
    for (int i = 0; i < waiting; ++i) send(numbered(++sent).SerializeAsString());
    std::uint64_t received = 0;
    int receipts = 0;
    for (; received != sent; ++receipts) {
      const auto message = subscriber.receive(kHung);
      ASSERT_TRUE(message);
      EXPECT_GT(std::get<Field>(*message).header.sequence, received);
      received = std::get<Field>(*message).header.sequence;
    }
    EXPECT_FALSE(subscriber.receive(0ms));
    EXPECT_TRUE(waiting < 5000 || receipts < waiting / 10) << receipts;
  }
  EXPECT_EQ(subscriber.lost(), 0U);
}

TEST(Subscriber, SocketsInADirectoryThatAnotherUserControlsAreRefused) {
  namespace fs = std::filesystem;
  const tractiond::test::TemporaryFolder temporary;
  const fs::path folder = temporary.path() / "open", own = folder / "tractiond";
  setenv("XDG_RUNTIME_DIR", folder.c_str(), 1);
  fs::create_directory(folder);
  fs::permissions(folder, fs::perms::all | fs::perms::sticky_bit);
  const auto isRefused = [](const char* instance) {
    try {
      SubscriberOptions options;
      options.instance = instance;
      const Subscriber subscriber(options);
      return false;
    } catch (const Error& error) {
      return error.code() == ErrorCode::kBadEndpoint &&
             std::string(error.what()).find("cannot be used: another user may control it") != std::string::npos;
    }
  };
  EXPECT_FALSE(isRefused("left"));
  EXPECT_EQ(fs::status(own).permissions(), fs::perms::owner_all) << "no other user can make it later";
  fs::create_directory(own / "default");
  const int listener = listenAt(own / "default/stream");
  EXPECT_FALSE(isRefused("default"));
  const auto areRefused = [&] { return isRefused("left") && isRefused("default"); };
  fs::permissions(own, fs::perms::all);
  EXPECT_TRUE(areRefused());
  fs::permissions(own, fs::perms::owner_all);
  EXPECT_FALSE(isRefused("left"));
  if (geteuid() == 0) {  // who can give directories away
    ASSERT_EQ(chown(own.c_str(), 65534, 65534), 0);
    EXPECT_TRUE(areRefused());
  }
  close(listener);
  unsetenv("XDG_RUNTIME_DIR");
}

TEST_F(SocketTest, WhatCameBeforeTheEndOfADaemonIsReadAfterIt) {
  constexpr int kFields = 100;
  Subscriber subscriber = subscribed(Mode::kStream);
  for (int i = 1; i <= kFields; ++i) {
    send("traction/v1/gel/field/", false);
    send(numbered(static_cast<std::uint64_t>(i)).SerializeAsString());
  }
  ASSERT_TRUE(subscriber.receive(kHung));
  publisher_.close();
  context_.close();  // waits until all is with the system that was sent
  ASSERT_TRUE(eventually([&] {
    std::this_thread::sleep_for(1ms);
    return !subscriber.isConnected();
  }));
  const int listener = listenAt(path_);
  pollfd comes{listener, POLLIN, 0};
  ASSERT_EQ(poll(&comes, 1, kHung_ms), 1);  // ZeroMQ tries the endpoint again by itself
  testClock += 300ms;                       // longer than an endpoint is left alone that was given up
  for (int i = 2; i <= kFields; ++i) ASSERT_TRUE(subscriber.receive(0ms)) << i;
  close(listener);
}

}  // namespace
}  // namespace traction::subscriber_test
