// One WebSocket: what a browser, or a client in Node, is sent and may ask.
#pragma once

#include "client/viewer/frame.h"

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <array>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace traction::view {

struct SessionOptions {
  /// Of each kind the newest alone, and no more than two of it that the other side has not done with ("next").
  /// Otherwise all, in order, as fast as the connection takes them; what does not fit into the queue is dropped, oldest
  /// first.
  bool newest = true;
  unsigned kinds = kAllKinds;
};

/// Of a URL: "mode=stream&topics=field,status".
SessionOptions parseSession(std::string_view query);

/// Bound to the server's thread.
class Session : public std::enable_shared_from_this<Session> {
 public:
  struct Handlers {
    std::function<void(Session& from, const std::string& id, const std::string& question)> ask;
    std::function<void(double from_s, double speed)> play;
    std::function<void(const Session* session)> gone;
  };

  Session(boost::asio::ip::tcp::socket&& socket, const SessionOptions& options, Handlers handlers);

  void start(const boost::beast::http::request<boost::beast::http::string_body>& request);
  /// Sent if it is wanted, when the other side has room.
  void offer(unsigned kind, const Frame& frame);
  /// Sent before all others.
  void answer(const Frame& frame);
  /// Ends it where the other side has not read for a while.
  void closeIfDeaf();

 private:
  using Clock = std::chrono::steady_clock;

  void read();
  void take(const std::string& text);
  void takeQuestion(std::string_view text);
  void pump();
  Frame next();
  void close();

  boost::beast::websocket::stream<boost::beast::tcp_stream> stream_;
  SessionOptions options_;
  Handlers handlers_;
  boost::beast::flat_buffer incoming_;
  std::array<Frame, kKindCount> newest_;
  std::deque<unsigned> order_;  ///< kinds of newest_ that wait, longest first
  std::deque<Frame> queue_;
  std::deque<Frame> answers_;
  Frame sending_;
  bool open_ = false, closed_ = false;
  std::deque<unsigned> unread_;             ///< kinds of what was sent, and is not done with; oldest first
  Clock::time_point since_ = Clock::now();  ///< something was sent, or done with
};

}  // namespace traction::view
