// Accepts TCP connections and reads HTTP requests: common to the server of the page and the Foxglove server.
#pragma once

#include "client/viewer/listen_address.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/http.hpp>

#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

namespace traction::view {

/// A WebSocket client is closed if it reads nothing for this long while messages for it are outstanding.
inline constexpr std::chrono::seconds kPatience{15};
/// Send buffer of a WebSocket [bytes]. Messages in it grow old while a slow client reads; newer ones cannot replace
/// them.
inline constexpr int kSendBuffer = 128 * 1024;

using Request = boost::beast::http::request<boost::beast::http::string_body>;
using Response = boost::beast::http::response<boost::beast::http::string_body>;

struct ListenerOptions {
  ListenAddress at;
  std::string option;          ///< of the command line that sets `at`; for error messages
  unsigned connections = 256;  ///< HTTP connections at a time; a new one beyond this closes the oldest
};

class HttpConnection;

/// Thread-bound: runs on the context's single thread. Closes a connection that sends no whole request, or reads no
/// answer, for 10 s, and one with more than 8 KiB of header or with a body.
class HttpListener {
 public:
  /// Returns the answer to a request. Returns nothing if it called `take`, which hands over the connection's socket.
  /// Called on the context's thread, which it must not block. Both arguments are valid during the call only.
  using Handler = std::function<std::optional<Response>(const Request& request,
                                                        const std::function<boost::asio::ip::tcp::socket()>& take)>;

  /// Binds and listens; accepts no connection before start(). \param context must outlive the listener, and must no
  /// longer run when it is destroyed \throws ServerError: EX_USAGE if the address is not an IP address, EX_UNAVAILABLE
  /// if it cannot be used
  HttpListener(boost::asio::io_context& context, const ListenerOptions& options, Handler handler);
  ~HttpListener();
  HttpListener(const HttpListener&) = delete;
  HttpListener& operator=(const HttpListener&) = delete;

  /// Starts accepting connections, and returns at once; they are served while the context runs. Must be called once.
  void start();
  /// Returns the address in URLs: "127.0.0.1:9880", "[::1]:9880"; "localhost:9880" if it listens at every address.
  std::string authority() const;

  // For HttpConnection.

  /// Returns what the handler returns for the request.
  std::optional<Response> handle(const Request& request,
                                 const std::function<boost::asio::ip::tcp::socket()>& take) const {
    return handler_(request, take);
  }
  /// Forgets a connection that has ended; has no effect if it is not known.
  void remove(const HttpConnection* connection);

 private:
  void add(boost::asio::ip::tcp::socket&& socket);

  ListenerOptions options_;
  Handler handler_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  std::list<std::shared_ptr<HttpConnection>> connections_;  ///< oldest first
};

}  // namespace traction::view
