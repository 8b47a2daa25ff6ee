// Peers of the publisher that mean no good.
#include "tests/support/temporary_folder.h"
#include "tests/unit/base/network/raw_peer.h"
#include "tests/unit/publish/publisher_bench.h"

namespace tractiond::publish::publisher_test {
namespace {

/// A peer that speaks the protocol and means no good.
class Hostile {
 public:
  explicit Hostile(const std::string& endpoint) {
    socket_.set(zmq::sockopt::linger, 0);
    socket_.set(zmq::sockopt::sndhwm, 0);
    socket_.set(zmq::sockopt::reconnect_ivl, -1);
    zmq_socket_monitor(socket_.handle(), "inproc://events", ZMQ_EVENT_DISCONNECTED);
    events_.connect("inproc://events");
    socket_.connect(endpoint);
  }
  ~Hostile() { zmq_socket_monitor(socket_.handle(), nullptr, 0); }

  void subscribe(const std::string& topic) { socket_.send(zmq::buffer("\1" + topic), zmq::send_flags::none); }
  bool isCutOff() {
    zmq::message_t event;
    return bool(events_.recv(event, zmq::recv_flags::dontwait));
  }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::xsub};
  zmq::socket_t events_{context_, zmq::socket_type::pair};
};

class HostilePeer : public PublisherTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    std::string endpoint = GetParam();
    if (endpoint.empty()) endpoint = "ipc://" + (folder_.path() / "stream").string();
    open(options({endpoint}));
  }
  void TearDown() override { publisher_.reset(); }

  void expectCutOff(Hostile& hostile) {
    EXPECT_TRUE(test::eventually([&] {
      publisher_->serve(-1, 10ms);
      return hostile.isCutOff();
    })) << "still connected";
  }

  const test::TemporaryFolder folder_;
};

INSTANTIATE_TEST_SUITE_P(Publisher, HostilePeer, testing::Values("tcp://127.0.0.1:*", ""),
                         [](const auto& instance) { return std::string(instance.index == 0 ? "Tcp" : "Ipc"); });

TEST_P(HostilePeer, TooLongASubscriptionCutsItOffAndNobodyElse) {
  const auto other = join(kRoot + "field/");
  Hostile hostile(stream_);
  hostile.subscribe(kRoot + std::string(100, 'x'));
  expectCutOff(hostile);
  publisher_->publish(field_);
  EXPECT_EQ(other->receive().topic, kRoot + "field/");
}

// With a high-water mark on what comes in, this aborts the process within ZeroMQ 4.3.4.
TEST_F(PublisherTest, PingBehindAFloodAndAResetDoNoHarm) {
  open();
  const auto other = join(kRoot + "field/");
  for (int i = 0; i < 20; ++i) {
    network::RawPeer peer(stream_, "SUB");
    std::string flood;
    for (int k = 0; k < 100; ++k) flood += network::RawPeer::message("\1a");
    peer.send(flood + network::RawPeer::command(std::string("\4PING\0\0", 7)) + network::RawPeer::message("\1a"));
    const network::RawPeer sent(stream_, "SUB");  // its handshake comes after what was sent
    peer.reset();
    const network::RawPeer gone(stream_, "SUB");
    publisher_->publish(field_);
    EXPECT_EQ(other->receive().topic, kRoot + "field/");
  }
}

}  // namespace
}  // namespace tractiond::publish::publisher_test
