// One client of the Foxglove WebSocket.
#pragma once

#include "client/viewer/foxglove_converter.h"
#include "client/viewer/foxglove_protocol.h"
#include "client/viewer/http_listener.h"

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace traction::view::foxglove {

/// Sends a client the newest message of each channel that it subscribed to, as fast as it reads.
///
/// What is on the way to the client is bounded: a WebSocket ping follows the messages, and no sample is sent while
/// kWindow bytes or more have been sent since the last ping that was answered. A sample that waits is replaced by a
/// newer one of its slot, so that a slow client gets fewer samples, not older ones. Only log lines are not replaced: up
/// to 64 of them wait, then the oldest is dropped. Thread-bound: runs on the context's thread.
class Session : public std::enable_shared_from_this<Session> {
 public:
  /// All must be set.
  struct Handlers {
    /// Called when the client subscribes to a channel. Returns why it cannot; empty if it can.
    std::function<std::string(Session& session, std::uint32_t channel)> subscribed;
    /// Called for each subscription that ends, also when the connection closes.
    std::function<void(std::uint32_t channel)> unsubscribed;
    /// Called once, when the connection has closed: also within close().
    std::function<void(const Session* session)> closed;
  };

  static constexpr std::size_t kWindow = 512 * 1024;  ///< [bytes]

  /// Must be owned by a std::shared_ptr, which the session shares from start() until the connection is closed.
  /// \param socket of a connection whose HTTP request has been read
  /// \param handlers called on the context's thread
  Session(boost::asio::ip::tcp::socket&& socket, Handlers handlers);

  /// Accepts the handshake, and then reads and sends. Returns at once. Must be called once.
  /// \param request that asked for the WebSocket
  /// \param subprotocol of chooseSubprotocol()
  /// \param greeting text messages that are sent first
  void start(const Request& request, std::string_view subprotocol, std::deque<std::string> greeting);
  /// Queues a text message, which is sent before all samples that wait, and after start()'s greeting.
  void tell(std::string message);
  /// Queues a sample, as the class comment says, for a client that is subscribed to the channel; has no effect
  /// otherwise.
  void offer(std::uint32_t channel, const Sample& sample);
  /// Closes the connection at once and, within the call, calls Handlers::unsubscribed for each subscription and then
  /// Handlers::closed. Further calls have no effect.
  void close();

 private:
  struct Subscriber {
    std::uint32_t id = 0;  ///< of the subscription
    std::deque<Sample> waiting;
  };

  void read();
  void take(const std::string& message, bool isText);
  void subscribe(const Subscribe& wanted);
  void unsubscribe(const Unsubscribe& wanted);
  void refuse(const std::string& why);
  void pump();
  /// Moves the next message to sending_. Returns whether there was one.
  bool next();
  void ping();
  void takePong(std::string_view payload);

  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
  Handlers handlers_;
  boost::beast::flat_buffer incoming_;
  std::map<std::uint32_t, Subscriber> subscribers_;  ///< by channel
  std::deque<std::uint32_t> order_;                  ///< channels that have samples waiting; the next one first
  std::deque<std::string> texts_;

  struct Sending {
    std::string head;                         ///< a text, or what precedes the data
    std::shared_ptr<const std::string> data;  ///< null: it is a text
  };
  std::optional<Sending> sending_;
  bool isOpen_ = false, isClosed_ = false;
  std::uint64_t sent_ = 0, answered_ = 0;  ///< bytes; answered: up to the last ping that was answered
  std::uint64_t pinged_ = 0;               ///< bytes up to the last ping
  bool isPinging_ = false;                 ///< the last ping is being written
};

}  // namespace traction::view::foxglove
