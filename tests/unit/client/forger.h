// A publisher of whatever it is told to publish.
#pragma once

#include "tests/unit/client/subscriber_bench.h"
#include "traction/v1/field.pb.h"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace traction::subscriber_test {

/// Has one subscriber of its own.
class Forger {
 public:
  /// The end of a forger waits until all is with the system that it has sent.
  explicit Forger(const std::string& endpoint = "tcp://127.0.0.1:*") {
    socket_.bind(endpoint);
    subscriber_ = std::make_unique<Subscriber>(at(socket_.get(zmq::sockopt::last_endpoint)));
    zmq::message_t subscription;
    [[maybe_unused]] const auto received = socket_.recv(subscription);
  }

  void send(const std::vector<std::string>& parts) {
    for (std::size_t i = 0; i < parts.size(); ++i) {
      socket_.send(zmq::buffer(parts[i]), i + 1 < parts.size() ? zmq::send_flags::sndmore : zmq::send_flags::none);
    }
  }
  void field(std::uint64_t sequence, char boot = 'b') {
    v1::Field field;
    field.mutable_header()->set_sequence(sequence);
    field.mutable_header()->set_boot(std::string(16, boot));
    send({"traction/v1/gel/field/", field.SerializeAsString(), "0.0"});
  }
  std::optional<ErrorCode> failure() {
    try {
      subscriber_->receive(kHung);
      return std::nullopt;
    } catch (const Error& error) {
      return error.code();
    }
  }
  Subscriber& subscriber() { return *subscriber_; }

 private:
  zmq::context_t context_;
  zmq::socket_t socket_{context_, zmq::socket_type::xpub};
  std::unique_ptr<Subscriber> subscriber_;
};

}  // namespace traction::subscriber_test
