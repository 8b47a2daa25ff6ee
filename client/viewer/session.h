// Serves one WebSocket of a browser or of a client in Node.
#pragma once

#include "client/viewer/frame.h"
#include "client/viewer/http_listener.h"

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace traction::view {

struct SessionOptions {
  /// True: sends only the newest frame of each kind, and at most two of a kind that the client has not acknowledged
  /// with "next". False: sends all frames in order, as fast as the connection takes them; at most
  /// 1,200 wait, then the oldest is dropped.
  bool newest = true;
  unsigned kinds = kAllKinds;  ///< that the client wants
};

/// Reads the query of a URL, "mode=stream&topics=field,status". Ignores what it does not know. Without topics the
/// client wants kAllKinds; with topics it wants these, kErrors, kTime and kRecorder.
SessionOptions parseSession(std::string_view query);

/// Bound to the server's thread. It lives until the connection is closed.
class Session : public std::enable_shared_from_this<Session> {
 public:
  /// All must be set.
  struct Handlers {
    /// Called for "ask ID QUESTION".
    /// \param id 1 to 16 digits, which the answer repeats
    std::function<void(Session& from, const std::string& id, const std::string& question)> ask;
    /// Called for "play SECONDS SPEED".
    /// \param from_s finite
    /// \param speed from 0 to 64
    std::function<void(double from_s, double speed)> play;
    /// Called once, when the connection has closed: also within answer().
    std::function<void(const Session* session)> gone;
  };

  /// Must be owned by a std::shared_ptr, which the session shares from start() until the connection is closed.
  /// \param socket of a connection whose HTTP request has been read
  /// \param handlers called on the server's thread
  Session(boost::asio::ip::tcp::socket&& socket, const SessionOptions& options, Handlers handlers);

  /// Accepts the handshake and starts to read and send. Returns at once. Must be called once.
  /// \param request that asked for the WebSocket
  void start(const Request& request);
  /// Queues the frame as SessionOptions::newest says, if the client wants its kind; has no effect otherwise. In both
  /// modes it waits for the handshake and while another frame is being written.
  /// \param kind one bit of Topics or Kinds
  void offer(unsigned kind, const Frame& frame);
  /// Queues the frame, before all that wait except earlier answers. Closes the connection instead if 16 answers wait:
  /// the client does not read.
  void answer(const Frame& frame);

 private:
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
  std::deque<unsigned> order_;  ///< indices of the frames in newest_ that wait; the first waits longest
  std::deque<Frame> queue_;
  std::size_t queued_bytes_ = 0;  ///< of queue_
  std::deque<Frame> answers_;
  Frame sending_;
  bool open_ = false, closed_ = false;
  std::deque<unsigned> unread_;  ///< indices of frames that were sent and not acknowledged, oldest first
};

}  // namespace traction::view
