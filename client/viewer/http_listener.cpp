#include "client/viewer/http_listener.h"

#include "client/files/failure.h"

#include <boost/beast/core.hpp>
#include <sysexits.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <set>
#include <utility>

namespace traction::view {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using beast::error_code;
using namespace std::chrono_literals;

/// A connection without a request for this long is closed.
constexpr auto kHttpPatience = 10s;
constexpr std::uint32_t kLongestHeader = 8192;
/// Connections at a time that are no WebSocket; further ones are closed at once, and leave descriptors for the sensors.
constexpr long kMostConnections = 256;

/// Permits scripts, pictures, styles and connections of this server alone, and no frame around the page.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; media-src blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// A connection before it becomes a WebSocket: reads one request after another. Thread-bound.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(const HttpListener& listener, tcp::socket&& socket, std::shared_ptr<const void> counted)
      : listener_(listener)
      , counted_(std::move(counted))
      , stream_(std::move(socket)) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(kLongestHeader);
    parser_->body_limit(0);
    stream_.expires_after(kHttpPatience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->answer();
    });
  }

 private:
  void answer() {
    const auto take = [this] {
      stream_.expires_never();
      return stream_.release_socket();
    };
    response_ = listener_.handle(parser_->get(), take);
    if (!response_) return;
    stream_.expires_after(kHttpPatience);
    http::async_write(stream_, *response_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error && !self->response_->need_eof()) return self->read();
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, error);
    });
  }

  const HttpListener& listener_;
  std::shared_ptr<const void> counted_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  std::optional<Response> response_;
};

}  // namespace

std::string_view headerOf(const Request& request, http::field name) {
  const beast::string_view value = request[name];
  return {value.data(), value.size()};
}

Response answerWith(const Request& request, std::string_view type, std::string body, http::status status) {
  Response response{status, request.version(), std::move(body)};
  response.keep_alive(request.keep_alive());
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Content-Security-Policy", kPolicy);
  response.set(http::field::cache_control, "no-cache");
  response.set(http::field::content_type, beast::string_view(type.data(), type.size()));
  response.prepare_payload();
  if (request.method() == http::verb::head) response.body().clear();
  return response;
}

Response refusalOf(const Request& request, http::status status, const std::string& why) {
  return answerWith(request, "text/plain; charset=utf-8", why + "\n", status);
}

void printRefusal(std::string line) {
  constexpr std::size_t kMost = 16;
  static std::set<std::string> printed;
  std::replace_if(
      line.begin(), line.end(), [](unsigned char byte) { return byte < 0x20 || byte > 0x7E; }, '?');
  if (printed.size() < kMost && printed.insert(line).second) std::cerr << "traction-view: " << line << std::endl;
}

HttpListener::HttpListener(asio::io_context& context, const ListenAddress& at, const std::string& option,
                           std::vector<std::string> hostNames, Handler handler)
    : hostNames_(std::move(hostNames))
    , handler_(std::move(handler))
    , acceptor_(context)
    , retry_(context) {
  error_code error;
  const auto address = asio::ip::make_address(at.address, error);
  if (error) throw client::Failure(EX_USAGE, "'" + at.address + "' is not an IP address");
  const tcp::endpoint endpoint(address, at.port);
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    throw client::Failure(EX_UNAVAILABLE, "cannot listen at " + at.address + ":" + std::to_string(at.port) + ": " +
                                              error.message() + "; choose another port with " + option);
  }
}

void HttpListener::start() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (!error) {
      socket.set_option(tcp::no_delay(true), error);
      if (connections_.use_count() <= kMostConnections)
        std::make_shared<HttpConnection>(*this, std::move(socket), connections_)->read();
      return start();
    }
    // For example, no file descriptor is left: connections that end soon will release some.
    retry_.expires_after(100ms);
    retry_.async_wait([this](error_code) { start(); });
  });
}

std::string HttpListener::authority() const {
  const tcp::endpoint at = acceptor_.local_endpoint();
  const bool isAny = at.address().is_unspecified();
  const std::string host = isAny ? "localhost" : at.address().to_string();
  return (at.address().is_v6() && !isAny ? "[" + host + "]" : host) + ":" + std::to_string(at.port());
}

std::optional<Response> HttpListener::handle(const Request& request, const std::function<tcp::socket()>& take) const {
  const std::string host(headerOf(request, http::field::host).substr(0, 200));
  if (isAllowedHost(headerOf(request, http::field::host), hostNames_)) return handler_(request, take);
  const std::string name = host.substr(0, host.find(':'));
  printRefusal("refused a request to the host '" + host +
               "', which is not known as this one; if it is, allow it with --name " + (name.empty() ? "HOST" : name));
  return refusalOf(request, http::status::misdirected_request,
                   "Unknown host name; traction-view --name HOST allows it.");
}

}  // namespace traction::view
