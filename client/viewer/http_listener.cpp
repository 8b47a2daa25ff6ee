#include "client/viewer/http_listener.h"

#include <boost/beast/core.hpp>
#include <sysexits.h>

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

}  // namespace

/// A connection before it becomes a WebSocket: reads one request after another. Thread-bound.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(HttpListener& listener, tcp::socket&& socket)
      : listener_(listener)
      , stream_(std::move(socket)) {}

  void read() {
    parser_.emplace();
    parser_->header_limit(kLongestHeader);
    parser_->body_limit(0);
    stream_.expires_after(kHttpPatience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->listener_.remove(self.get());
      self->answer();
    });
  }

  void close() {
    error_code ignored;
    stream_.socket().close(ignored);
  }

 private:
  void answer() {
    const auto take = [this] {
      stream_.expires_never();
      return stream_.release_socket();
    };
    response_ = listener_.handle(parser_->get(), take);
    if (!response_) return listener_.remove(this);
    stream_.expires_after(kHttpPatience);
    http::async_write(stream_, *response_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error && !self->response_->need_eof()) return self->read();
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, error);
      self->listener_.remove(self.get());
    });
  }

  HttpListener& listener_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  std::optional<Response> response_;
};

HttpListener::HttpListener(asio::io_context& context, const ListenerOptions& options, Handler handler)
    : options_(options)
    , handler_(std::move(handler))
    , acceptor_(context)
    , retry_(context) {
  error_code error;
  const auto address = asio::ip::make_address(options_.at.address, error);
  if (error) throw ServerError(EX_USAGE, "'" + options_.at.address + "' is not an IP address");
  const tcp::endpoint endpoint(address, options_.at.port);
  acceptor_.open(endpoint.protocol(), error);
  if (!error) acceptor_.set_option(asio::socket_base::reuse_address(true), error);
  if (!error) acceptor_.bind(endpoint, error);
  if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    throw ServerError(EX_UNAVAILABLE, "cannot listen at " + options_.at.address + ":" +
                                          std::to_string(options_.at.port) + ": " + error.message() +
                                          "; choose another port with " + options_.option);
  }
}

HttpListener::~HttpListener() = default;

void HttpListener::start() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (!error) {
      add(std::move(socket));
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

void HttpListener::add(tcp::socket&& socket) {
  error_code ignored;
  socket.set_option(tcp::no_delay(true), ignored);
  if (connections_.size() >= options_.connections) {
    connections_.front()->close();
    connections_.pop_front();
  }
  connections_.push_back(std::make_shared<HttpConnection>(*this, std::move(socket)));
  connections_.back()->read();
}

void HttpListener::remove(const HttpConnection* connection) {
  connections_.remove_if([&](const std::shared_ptr<HttpConnection>& each) { return each.get() == connection; });
}

}  // namespace traction::view
