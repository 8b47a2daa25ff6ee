#include "client/viewer/foxglove_session.h"

#include <boost/asio/post.hpp>

#include <algorithm>
#include <charconv>
#include <iterator>
#include <utility>

namespace traction::view::foxglove {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using beast::error_code;

/// Bytes of a client's message. 500 subscriptions in one message are 20,000.
constexpr std::size_t kLongestMessage = 32 * 1024;
/// A client's errors are not sent to it while this many texts wait.
constexpr std::size_t kMostTexts = 32;
/// Lines of a log that wait for a slow client; the oldest are dropped.
constexpr std::size_t kMostLines = 64;

}  // namespace

Session::Session(asio::ip::tcp::socket&& socket, Handlers handlers)
    : stream_(std::move(socket))
    , handlers_(std::move(handlers)) {}

void Session::start(const Request& request, std::string_view subprotocol, std::deque<std::string> greeting) {
  // Goes before a status that was queued in the meantime: serverInfo must be the first message.
  texts_.insert(texts_.begin(), std::make_move_iterator(greeting.begin()), std::make_move_iterator(greeting.end()));
  error_code ignored;
  beast::get_lowest_layer(stream_).socket().set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  stream_.set_option(websocket::stream_base::timeout{kPatience, 2 * kPatience, true});
  stream_.set_option(
      websocket::stream_base::decorator([subprotocol = std::string(subprotocol)](websocket::response_type& response) {
        response.set(beast::http::field::sec_websocket_protocol, subprotocol);
      }));
  stream_.read_message_max(kLongestMessage);
  stream_.auto_fragment(false);
  stream_.control_callback([this](websocket::frame_type kind, beast::string_view payload) {
    if (kind == websocket::frame_type::pong) takePong({payload.data(), payload.size()});
  });
  stream_.async_accept(request, [self = shared_from_this()](error_code error) {
    if (error) return self->close();
    self->isOpen_ = true;
    self->read();
    self->pump();
  });
}

void Session::read() {
  stream_.async_read(incoming_, [self = shared_from_this()](error_code error, std::size_t) {
    if (error) return self->close();
    self->take(beast::buffers_to_string(self->incoming_.data()), self->stream_.got_text());
    self->incoming_.clear();
    self->read();
  });
}

void Session::take(const std::string& message, bool isText) {
  if (!isText) return refuse("binary messages need a capability that this server does not offer: it only publishes");
  const ClientMessage parsed = parseText(message);
  if (const auto* wanted = std::get_if<Subscribe>(&parsed)) subscribe(*wanted);
  if (const auto* wanted = std::get_if<Unsubscribe>(&parsed)) unsubscribe(*wanted);
  if (const auto* refused = std::get_if<Refused>(&parsed)) refuse(refused->why);
}

void Session::subscribe(const Subscribe& wanted) {
  for (const auto& [id, channel] : wanted.subscriptions) {
    const std::string name = "subscription " + std::to_string(id) + " to channel " + std::to_string(channel);
    const bool isIdUsed = std::any_of(subscribers_.begin(), subscribers_.end(),
                                      [id = id](const auto& each) { return each.second.id == id; });
    if (isIdUsed) {
      refuse(name + ": the id is already used by another subscription");
    } else if (subscribers_.contains(channel)) {
      refuse(name + ": there is a subscription to this channel already");
    } else {
      subscribers_[channel].id = id;
      const std::string why = handlers_.subscribed(*this, channel);
      if (why.empty()) continue;
      subscribers_.erase(channel);
      refuse(name + ": " + why);
    }
  }
}

void Session::unsubscribe(const Unsubscribe& wanted) {
  for (const std::uint32_t id : wanted.ids) {
    const auto found =
        std::find_if(subscribers_.begin(), subscribers_.end(), [id](const auto& each) { return each.second.id == id; });
    if (found == subscribers_.end()) {
      refuse("unsubscribe: there is no subscription " + std::to_string(id));
      continue;
    }
    const std::uint32_t channel = found->first;
    std::erase(order_, channel);
    subscribers_.erase(found);
    handlers_.unsubscribed(channel);
  }
}

/// Reports why a message was refused. One message can hold many errors; those that do not fit are omitted.
void Session::refuse(const std::string& why) {
  if (texts_.size() < kMostTexts) tell(errorStatus(why));
}

void Session::tell(std::string message) {
  texts_.push_back(std::move(message));
  pump();
}

void Session::offer(std::uint32_t channel, const Sample& sample) {
  const auto found = subscribers_.find(channel);
  if (found == subscribers_.end() || isClosed_) return;
  auto& waiting = found->second.waiting;
  if (waiting.empty()) order_.push_back(channel);
  const auto older =
      std::find_if(waiting.begin(), waiting.end(), [&](const Sample& each) { return each.slot == sample.slot; });
  if (sample.kind == kLogs) {
    if (waiting.size() >= kMostLines) waiting.pop_front();
    waiting.push_back(sample);
  } else if (older != waiting.end()) {
    *older = sample;
  } else {
    waiting.push_back(sample);
  }
  pump();
}

bool Session::next() {
  if (!texts_.empty()) {
    sending_ = Sending{.head = std::move(texts_.front()), .data = nullptr};
    texts_.pop_front();
    return true;
  }
  if (order_.empty() || sent_ - answered_ >= kWindow) return false;
  const std::uint32_t channel = order_.front();
  order_.pop_front();
  Subscriber& subscriber = subscribers_.at(channel);
  const Sample& sample = subscriber.waiting.front();
  const auto header = dataHeader(subscriber.id, sample.logTime_ns);
  sending_ = Sending{.head = std::string(header.begin(), header.end()), .data = sample.data};
  subscriber.waiting.pop_front();
  if (!subscriber.waiting.empty()) order_.push_back(channel);
  return true;
}

void Session::pump() {
  if (!isOpen_ || isClosed_ || sending_ || !next()) return;
  const auto written = [self = shared_from_this()](error_code error, std::size_t bytes) {
    self->sending_.reset();
    if (error) return self->close();
    self->sent_ += bytes;
    self->ping();
    self->pump();
  };
  stream_.text(sending_->data == nullptr);
  const std::array<asio::const_buffer, 2> parts = {
      asio::buffer(sending_->head), sending_->data ? asio::buffer(*sending_->data) : asio::const_buffer()};
  stream_.async_write(parts, written);
}

/// Asks the client to confirm what was sent, unless an earlier ping is not answered yet.
void Session::ping() {
  if (isPinging_ || isClosed_ || pinged_ != answered_ || sent_ == pinged_) return;
  isPinging_ = true;
  pinged_ = sent_;
  const std::string payload = std::to_string(pinged_);
  stream_.async_ping({payload.data(), payload.size()}, [self = shared_from_this()](error_code error) {
    self->isPinging_ = false;
    if (error) return self->close();
    self->ping();
  });
}

void Session::takePong(std::string_view payload) {
  std::uint64_t bytes = 0;
  const auto [end, bad] = std::from_chars(payload.data(), payload.data() + payload.size(), bytes);
  // Pings of Beast's own timer are answered, too; they have no payload.
  if (bad != std::errc() || end != payload.data() + payload.size() || bytes != pinged_) return;
  answered_ = bytes;
  // Posts the work, as this function runs within a read of Beast.
  asio::post(stream_.get_executor(), [self = shared_from_this()] {
    self->ping();
    self->pump();
  });
}

void Session::close() {
  if (isClosed_) return;
  isClosed_ = true;
  error_code ignored;
  beast::get_lowest_layer(stream_).socket().close(ignored);
  const auto self = shared_from_this();
  const auto closed = subscribers_;
  subscribers_.clear();
  order_.clear();
  for (const auto& [channel, subscriber] : closed) handlers_.unsubscribed(channel);
  handlers_.closed(this);
}

}  // namespace traction::view::foxglove
