#include "client/viewer/session.h"

#include "proto/traction/v1/endpoints.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <utility>

namespace traction::view {

namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using beast::error_code;

/// Longest message of a client; the longest in use describes a gel of four layers, "ask ID setup {...}".
constexpr std::size_t kLongestMessage = 8192;
/// Frames of a kind that may be on the way or wait in the browser.
constexpr int kWindow = 2;
/// Frames that may wait for a client that wants all: ten seconds of fields and markers at 60 frames/s.
constexpr std::size_t kQueue = 1200, kQueue_bytes = 256 << 20;
constexpr std::size_t kAnswers = 16;
/// Highest speed of a recording, in multiples of its pace.
constexpr double kFastest = 64.0;

/// Kinds that a client can ask for besides those of messages, by their names.
constexpr std::array<std::pair<std::string_view, unsigned>, 4> kNames = {
    {{"picture", kPicture}, {"places", kPlaces}, {"surface", kSurface}, {"health", kHealth}}};

/// Calls `visit` for each part between separators.
template <typename Visit>
void split(std::string_view text, char separator, const Visit& visit) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    visit(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace

SessionOptions parseSession(std::string_view query) {
  SessionOptions options;
  split(query, '&', [&](std::string_view part) {
    if (part == "mode=stream") options.newest = false;
    constexpr std::string_view kTopics = "topics=";
    if (part.substr(0, kTopics.size()) != kTopics) return;
    options.kinds = kErrors | kTime | kRecorder;
    split(part.substr(kTopics.size()), ',', [&](std::string_view name) {
      for (const auto& [known, kind] : kNames) options.kinds |= known == name ? kind : 0U;
      for (std::size_t i = 0; i < kTopicKinds.size(); ++i) options.kinds |= kTopicKinds.at(i) == name ? 1U << i : 0U;
    });
  });
  return options;
}

Session::Session(boost::asio::ip::tcp::socket&& socket, const SessionOptions& options, Handlers handlers)
    : stream_(std::move(socket))
    , options_(options)
    , handlers_(std::move(handlers)) {}

void Session::start(const Request& request) {
  error_code ignored;
  beast::get_lowest_layer(stream_).socket().set_option(boost::asio::socket_base::send_buffer_size(kSendBuffer),
                                                       ignored);
  stream_.set_option(websocket::stream_base::timeout{kPatience, 2 * kPatience, true});
  stream_.read_message_max(kLongestMessage);
  stream_.binary(true);
  stream_.async_accept(request, [self = shared_from_this()](error_code error) {
    if (error) return self->close();
    self->open_ = true;
    self->read();
    self->pump();
  });
}

void Session::read() {
  stream_.async_read(incoming_, [self = shared_from_this()](error_code error, std::size_t) {
    if (error) return self->close();
    self->take(beast::buffers_to_string(self->incoming_.data()));
    self->incoming_.clear();
    self->read();
  });
}

/// Handles "next" (the oldest frame has been used), "ask ID QUESTION" and "play SECONDS SPEED"; ignores other texts,
/// which later versions may define.
void Session::take(const std::string& text) {
  if (text == "next") {
    if (!unread_.empty()) unread_.pop_front();
    return pump();
  }
  constexpr std::string_view kAsk = "ask ";
  if (text.starts_with(kAsk)) return takeQuestion(std::string_view(text).substr(kAsk.size()));
  double from_s = 0.0, speed = 0.0;
  int end = 0;
  const bool isPlay = std::sscanf(text.c_str(), "play %lf %lf%n", &from_s, &speed, &end) == 2;
  if (!isPlay || static_cast<std::size_t>(end) != text.size() || !std::isfinite(from_s)) return;
  if (speed >= 0.0 && speed <= kFastest) handlers_.play(from_s, speed);
}

void Session::takeQuestion(std::string_view text) {
  const std::size_t blank = text.find(' ');
  if (blank == std::string_view::npos) return;
  const std::string id(text.substr(0, blank));
  constexpr std::size_t kLongestId = 16;
  if (id.empty() || id.size() > kLongestId || id.find_first_not_of("0123456789") != std::string::npos) return;
  handlers_.ask(*this, id, std::string(text.substr(blank + 1)));
}

void Session::offer(unsigned kind, const Frame& frame) {
  if ((options_.kinds & kind) == 0 || closed_) return;
  if (options_.newest) {
    Frame& place = newest_.at(static_cast<unsigned>(std::countr_zero(kind)));
    if (!place) order_.push_back(static_cast<unsigned>(std::countr_zero(kind)));
    place = frame;
  } else {
    queued_bytes_ += frame->size();
    for (; !queue_.empty() && (queue_.size() >= kQueue || queued_bytes_ > kQueue_bytes); queue_.pop_front())
      queued_bytes_ -= queue_.front()->size();
    queue_.push_back(frame);
  }
  pump();
}

void Session::answer(const Frame& frame) {
  if (answers_.size() >= kAnswers) return close();
  answers_.push_back(frame);
  pump();
}

Frame Session::next() {
  Frame frame;
  if (!answers_.empty()) {
    frame = answers_.front();
    answers_.pop_front();
    return frame;
  }
  if (!options_.newest) {
    if (queue_.empty()) return frame;
    frame = queue_.front();
    queue_.pop_front();
    queued_bytes_ -= frame->size();
    return frame;
  }
  const auto chosen = std::find_if(order_.begin(), order_.end(), [this](unsigned kind) {
    return std::count(unread_.begin(), unread_.end(), kind) < kWindow;
  });
  if (chosen == order_.end()) return frame;
  const unsigned kind = *chosen;
  order_.erase(chosen);
  frame = std::exchange(newest_.at(kind), nullptr);
  unread_.push_back(kind);
  return frame;
}

void Session::pump() {
  if (!open_ || closed_ || sending_) return;
  sending_ = next();
  if (!sending_) return;
  stream_.async_write(boost::asio::buffer(*sending_), [self = shared_from_this()](error_code error, std::size_t) {
    self->sending_.reset();
    if (error) return self->close();
    self->pump();
  });
}

void Session::close() {
  if (closed_) return;
  closed_ = true;
  error_code ignored;
  beast::get_lowest_layer(stream_).socket().close(ignored);
  handlers_.gone(this);
}

}  // namespace traction::view
