// Accepts TCP connections and reads HTTP requests: common to the server of the page and the Foxglove server.
#pragma once

#include "client/viewer/listen_address.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/http.hpp>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace traction::view {

/// A WebSocket client is closed if it reads nothing for this long while messages for it are outstanding.
inline constexpr std::chrono::seconds kPatience{15};
/// Send buffer of a WebSocket [bytes]. Messages in it grow old while a slow client reads; newer ones cannot replace
/// them.
inline constexpr int kSendBuffer = 128 * 1024;

using Request = boost::beast::http::request<boost::beast::http::string_body>;
using Response = boost::beast::http::response<boost::beast::http::string_body>;

/// Returns the value of a header; empty: it is absent. Valid as long as the request.
std::string_view headerOf(const Request& request, boost::beast::http::field name);

/// Returns an answer with the headers that all have. The body is left out of the answer to HEAD.
Response answerWith(const Request& request, std::string_view type, std::string body,
                    boost::beast::http::status status = boost::beast::http::status::ok);
/// Returns an answer of one line of text.
Response refusalOf(const Request& request, boost::beast::http::status status, const std::string& why);

/// Prints on standard error why a request was refused, as a browser only reports that the connection failed: each line
/// once, and 16 at most, as web pages choose what is in them; '?' for what would control a terminal. Must be called on
/// the servers' thread.
void printRefusal(std::string line);

/// Thread-bound: runs on the context's single thread. Closes a connection that sends no whole request, or reads no
/// answer, for 10 s, and one with more than 8 KiB of header or with a body.
class HttpListener {
 public:
  /// Returns the answer to a request. Returns nothing if it called `take`, which hands over the connection's socket.
  /// Called on the context's thread, which it must not block. Both arguments are valid during the call only.
  using Handler = std::function<std::optional<Response>(const Request& request,
                                                        const std::function<boost::asio::ip::tcp::socket()>& take)>;

  /// Binds and listens; accepts no connection before start(). Refuses requests to other hosts than isAllowedHost().
  /// \param context must outlive the listener, and must no longer run when it is destroyed
  /// \param option of the command line that sets `at`, for error messages
  /// \param hostNames names of this host that requests may use besides IP addresses and localhost
  /// \throws client::Failure: EX_USAGE if the address is not an IP address, EX_UNAVAILABLE if it cannot be used
  HttpListener(boost::asio::io_context& context, const ListenAddress& at, const std::string& option,
               std::vector<std::string> hostNames, Handler handler);

  /// Starts accepting connections, and returns at once; they are served while the context runs. Must be called once.
  void start();
  /// Returns the address in URLs: "127.0.0.1:9880", "[::1]:9880"; "localhost:9880" if it listens at every address.
  std::string authority() const;

  /// Returns the answer of the handler, or the refusal of a host. For the listener's connections.
  std::optional<Response> handle(const Request& request,
                                 const std::function<boost::asio::ip::tcp::socket()>& take) const;

 private:
  std::vector<std::string> hostNames_;
  Handler handler_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer retry_;
  std::shared_ptr<const void> connections_ =
      std::make_shared<char>();  ///< each holds a copy, by which they are counted
};

}  // namespace traction::view
