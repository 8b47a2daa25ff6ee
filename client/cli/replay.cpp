#include "base/network/socket.h"
#include "client/cli/recordings.h"
#include "client/files/failure.h"
#include "client/show/output.h"
#include "client/show/terminal.h"
#include "recording/reader.h"

#include <sysexits.h>
#include <zmq.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <string_view>

namespace traction::client {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTurn = 20ms;
constexpr double kNever_s = 1e9;                   ///< times of a file may be anything
constexpr int kHighWaterMark = 1000;               ///< messages that wait for a slow client, which loses further ones
constexpr std::int64_t kLargestSubscription = 64;  ///< [bytes]

struct Stopped {};

/// Publishes recorded messages as tractiond publishes its stream.
class Repeater {
 public:
  /// Binds the ZeroMQ endpoint. Its end waits up to a second for slow readers.
  /// \throws Error kBadEndpoint
  explicit Repeater(const std::string& endpoint) {
    tractiond::network::guard(socket_, kHighWaterMark, kLargestSubscription);
    socket_.set(zmq::sockopt::linger, 1000);
    socket_.set(zmq::sockopt::xpub_verbose, true);  // reports later subscribers, too
    const auto bound = tractiond::network::bind(socket_, {endpoint});
    if (!bound) throw Error(ErrorCode::kBadEndpoint, bound.error().what);
    endpoint_ = bound->front();
  }

  /// Returns the endpoint, with the port in use.
  const std::string& endpoint() const { return endpoint_; }
  /// Returns whether a subscription has ever come.
  bool isHeard() const { return isHeard_; }

  /// Waits until the time is due. For each subscription that begins meanwhile, publishes the last description of each
  /// sensor again, which all subscribers of descriptions receive.
  /// \throws Stopped on a signal
  void listenUntil(Clock::time_point due) {
    for (;;) {
      if (stopRequested()) throw Stopped{};
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(due - Clock::now());
      if (left <= 0ms) return;
      zmq_pollitem_t item = tractiond::network::readable(socket_);
      if (zmq_poll(&item, 1, static_cast<long>(std::min(left, kTurn).count())) <= 0) continue;
      for (zmq::message_t said; zmq_msg_recv(said.handle(), socket_.handle(), ZMQ_DONTWAIT) >= 0;) {
        if (said.empty() || *said.data<char>() != 1) continue;  // 1: subscribes
        isHeard_ = true;
        for (const auto& [topic, parts] : descriptions_) sendParts(parts);
      }
    }
  }

  /// Sends a message, and keeps a copy if it is a description. Does not wait: a client that is too slow loses it.
  void send(const std::string& topic, std::string_view bytes, double time_s) {
    std::array<char, 40> time{};
    std::snprintf(time.data(), time.size(), "%.9f", time_s);
    const Parts parts{topic, std::string(bytes), time.data()};
    if (topic.ends_with("/description/")) descriptions_[topic] = parts;
    sendParts(parts);
  }

 private:
  using Parts = std::array<std::string, 3>;

  void sendParts(const Parts& parts) {
    for (const std::string& part : parts) {
      const int flags = ZMQ_DONTWAIT | (&part == &parts.back() ? 0 : ZMQ_SNDMORE);
      if (zmq_send(socket_.handle(), part.data(), part.size(), flags) < 0)
        return;  // interrupted by a signal: the program is about to end
    }
  }

  zmq::context_t context_{1};
  zmq::socket_t socket_{context_, zmq::socket_type::xpub};
  std::string endpoint_;
  std::map<std::string, Parts> descriptions_;  ///< by topic, the last
  bool isHeard_ = false;
};

}  // namespace

void replay(const std::string& file, const std::string& endpoint, double speed) {
  const auto reader = orThrow(recording::Reader::open(file));
  Repeater repeater(endpoint);
  rememberSignals();
  printLine("waiting for a subscriber at " + repeater.endpoint());
  std::uint64_t messages = 0, first_ns = 0;
  Clock::time_point begin;
  try {
    while (!repeater.isHeard()) repeater.listenUntil(Clock::now() + kTurn);
    begin = Clock::now();
    const auto extent = orThrow(reader.read(
        [&](const recording::Channel& channel, const recording::Schema*, const recording::Message& message) {
          if (!channel.topic.starts_with("traction/")) return;  // the stream has no other
          if (messages++ == 0) first_ns = message.logTime_ns;
          const std::uint64_t after_ns = message.logTime_ns - std::min(first_ns, message.logTime_ns);
          const std::chrono::duration<double> after(std::min(1e-9 * static_cast<double>(after_ns) / speed, kNever_s));
          repeater.listenUntil(begin + std::chrono::duration_cast<Clock::duration>(after));
          repeater.send(channel.topic, message.data, 1e-9 * static_cast<double>(message.publishTime_ns));
        }));
    printLine(file + ": " + std::to_string(messages) + " messages sent");
    if (!extent.isWhole()) throw Failure(EX_DATAERR, file + ": " + extent.trouble);
  } catch (const Stopped&) {
    std::printf("%s: stopped after %llu messages\n", file.c_str(), static_cast<unsigned long long>(messages));
  }
}

}  // namespace traction::client
