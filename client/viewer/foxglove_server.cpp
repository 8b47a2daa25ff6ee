#include "client/viewer/foxglove_server.h"

#include <boost/asio/post.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <unistd.h>

#include <algorithm>

namespace traction::view {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using beast::error_code;
using foxglove::Level;
using foxglove::Sample;
using namespace std::chrono_literals;

/// Sources run on for this long without clients that want them: those that connect or subscribe again and again start
/// and stop no threads.
constexpr auto kLinger = 10s;
/// Lines of a log that a new subscriber is sent.
constexpr std::size_t kLines = 16;
/// An endpoint's last error is told to new clients, and not repeated to the others, for this long.
constexpr auto kErrorLasts = 10s;
constexpr std::size_t kMostSensors = 64;  ///< of one feed

std::string_view textOf(beast::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

FoxgloveServer::FoxgloveServer(asio::io_context& context, const FoxgloveOptions& options,
                               std::vector<std::string> hostNames, const std::vector<SourceOptions>& sources)
    : options_(options)
    , hostNames_(std::move(hostNames))
    , listener_(context, {options.listen, "--foxglove", options.connections},
                [this](const Request& request, const auto& take) { return handle(request, take); })
    , timer_(context)
    , session_(std::to_string(getpid()) + "-" + std::to_string(Clock::now().time_since_epoch().count())) {
  for (const SourceOptions& each : sources) {
    feeds_.push_back(std::make_unique<Feed>(context));
    feeds_.back()->number = feeds_.size();
    feeds_.back()->options = each;
  }
}

FoxgloveServer::~FoxgloveServer() {
  reaper_.join();
}

void FoxgloveServer::start() {
  listener_.start();
  tick();
}

std::optional<Response> FoxgloveServer::handle(const Request& request, const std::function<tcp::socket()>& take) {
  const auto answer = [&](http::status status, const std::string& why) {
    Response response{status, request.version()};
    response.keep_alive(false);
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Content-Security-Policy", "default-src 'none'; frame-ancestors 'none'");
    response.set(http::field::content_type, "text/plain; charset=utf-8");
    response.body() = why + "\n";
    response.prepare_payload();
    return response;
  };
  const std::string origin(textOf(request[http::field::origin]));
  if (!isAllowedHost(textOf(request[http::field::host]), hostNames_)) {
    refusals_.print(unknownHost(textOf(request[http::field::host])));
    return answer(http::status::misdirected_request, "Unknown host name; traction-view --name HOST allows it.");
  }
  if (!foxglove::isAllowedOrigin(origin, options_.origins)) {
    reportOrigin(origin);
    return answer(http::status::forbidden,
                  "Pages of this origin are refused; traction-view --foxglove-origin ORIGIN allows one.");
  }
  if (!beast::websocket::is_upgrade(request)) {
    return answer(http::status::upgrade_required,
                  "This is a Foxglove WebSocket: in Foxglove or Lichtblick, choose Open connection.");
  }
  const std::string_view subprotocol =
      foxglove::chooseSubprotocol(textOf(request[http::field::sec_websocket_protocol]));
  if (subprotocol.empty()) {
    return answer(http::status::bad_request,
                  "The subprotocol must be foxglove.sdk.v1 or foxglove.websocket.v1 (Sec-WebSocket-Protocol).");
  }
  if (sessions_.size() >= options_.clients) {
    return answer(http::status::service_unavailable, "Too many clients are connected.");
  }
  open(request, subprotocol, take());
  return std::nullopt;
}

void FoxgloveServer::reportOrigin(const std::string& origin) {
  const std::string text = printableHeader(origin);
  refusals_.print("refused a Foxglove connection by a page of the origin '" + text +
                  "'; if it is a Foxglove or Lichtblick of your own, allow it with --foxglove-origin " + text);
}

void FoxgloveServer::open(const Request& request, std::string_view subprotocol, tcp::socket&& socket) {
  auto session = std::make_shared<foxglove::Session>(
      std::move(socket),
      foxglove::Session::Handlers{
          .subscribed = [this](foxglove::Session& from, std::uint32_t channel) { return subscribe(from, channel); },
          .unsubscribed = [this](std::uint32_t channel) { unsubscribe(channel); },
          .closed =
              [this](const foxglove::Session* gone) {
                sessions_.remove_if([&](const auto& each) { return each.get() == gone; });
              }});
  std::vector<foxglove::Channel> known;
  for (const ChannelState& each : channels_) known.push_back(each.channel);
  std::deque<std::string> greeting = {foxglove::serverInfo("traction-view " TRACTION_VERSION, session_),
                                      foxglove::advertise(known)};
  for (const auto& feed : feeds_) {
    if (!feed->error.empty()) greeting.push_back(foxglove::status(Level::kError, feed->error));
  }
  for (const std::string& each : conflicts_) greeting.push_back(foxglove::status(Level::kError, each));
  sessions_.push_back(session);
  for (const auto& feed : feeds_) update(*feed);
  session->start(request, subprotocol, std::move(greeting));
}

std::string FoxgloveServer::subscribe(foxglove::Session& session, std::uint32_t channel) {
  if (channel >= channels_.size()) return "there is no such channel";
  ChannelState& state = channels_[channel];
  ++state.subscribers;
  update(*state.feed);
  for (const auto& [slot, sample] : state.lasting) session.offer(channel, sample);
  for (const Sample& line : state.lines) session.offer(channel, line);
  return {};
}

void FoxgloveServer::unsubscribe(std::uint32_t channel) {
  ChannelState& state = channels_.at(channel);
  if (--state.subscribers == 0) state.lines.clear();
  update(*state.feed);
}

void FoxgloveServer::tick() {
  timer_.expires_after(1s);
  timer_.async_wait([this](error_code) {
    for (const auto& feed : feeds_) {
      update(*feed);
      if (Clock::now() - feed->failed > kErrorLasts) feed->error.clear();
    }
    tick();
  });
}

void FoxgloveServer::update(Feed& feed) {
  if (!sessions_.empty()) connected_ = Clock::now();
  const bool isWanted = !sessions_.empty() || (feed.source && Clock::now() - connected_ < kLinger);
  unsigned kinds = 0;
  for (const ChannelState& each : channels_) {
    if (each.feed == &feed && each.subscribers > 0) kinds |= each.kind;
  }
  if (isWanted && !feed.source) {
    feed.converter = makeConverter(feed);
    feed.source = makeSource(feed, kAllTopics | kContacts, *feed.converter);
  } else if (!isWanted && feed.source) {
    stop(feed.source, feed.converter);
    for (ChannelState& each : channels_) {
      if (each.feed == &feed) each.lasting.clear();
    }
  }
  if (feed.converter) feed.converter->want(kinds & ~foxglove::kOfPreviews);

  const bool wantsPreviews = (kinds & foxglove::kOfPreviews) != 0;
  if (wantsPreviews) feed.previewsWanted = Clock::now();
  if (wantsPreviews && !feed.previewSource) {
    feed.previewConverter = makeConverter(feed);
    feed.previewSource = makeSource(feed, kPreview, *feed.previewConverter);
  } else if (feed.previewSource && Clock::now() - feed.previewsWanted >= kLinger) {
    stop(feed.previewSource, feed.previewConverter);
  }
  if (feed.previewConverter) feed.previewConverter->want(kinds & foxglove::kOfPreviews);
}

std::unique_ptr<foxglove::Converter> FoxgloveServer::makeConverter(Feed& feed) {
  return std::make_unique<foxglove::Converter>(
      [this, &feed](const Sample& sample) { feed.backlog.post([this, &feed, sample] { deliver(feed, sample); }); });
}

std::unique_ptr<Source> FoxgloveServer::makeSource(Feed& feed, unsigned topics, foxglove::Converter& converter) {
  SubscriberOptions subscription = feed.options.subscription;
  subscription.topics = topics;
  try {
    return std::make_unique<Source>(
        subscription,
        Source::Handlers{.pass = [&converter](const Message& message, const Raw& raw) { converter.pass(message, raw); },
                         .fail =
                             [this, &feed](const Error& error, const Raw&) {
                               feed.backlog.post(
                                   [this, &feed, what = std::string(error.what())] { tellError(feed, what); });
                             }});
  } catch (const Error& error) {
    tellError(feed, error.what());
    return nullptr;
  }
}

/// Ends a source on another thread, as its destructor waits for its thread.
void FoxgloveServer::stop(std::unique_ptr<Source>& source, std::unique_ptr<foxglove::Converter>& converter) {
  struct Ended {
    std::unique_ptr<foxglove::Converter> converter;
    std::unique_ptr<Source> source;  // behind the converter, which its thread uses
  };
  auto ended = std::make_shared<Ended>();
  ended->converter = std::move(converter);
  ended->source = std::move(source);
  asio::post(reaper_, [ended = std::move(ended)]() mutable { ended.reset(); });
}

void FoxgloveServer::deliver(Feed& feed, const Sample& sample) {
  if (!feed.sensors.contains(sample.sensor)) {
    if (feed.sensors.size() >= kMostSensors) return;
    feed.sensors.insert(sample.sensor);
    advertise(feed, sample.sensor);
  }
  const auto* type = std::find_if(foxglove::kChannelTypes.begin(), foxglove::kChannelTypes.end(),
                                  [&](const auto& each) { return each.kind == sample.kind; });
  const auto found = ids_.find(foxglove::topicOf(sample.sensor, *type));
  if (found == ids_.end()) return;
  ChannelState& state = channels_[found->second];
  if (state.feed != &feed) return;
  if (sample.isLasting) state.lasting[sample.slot] = sample;
  if (state.kind == foxglove::kLogs && state.subscribers > 0) {
    if (state.lines.size() >= kLines) state.lines.pop_front();
    state.lines.push_back(sample);
  }
  if (state.subscribers == 0) return;
  for (const auto& session : sessions_) session->offer(state.channel.id, sample);
}

void FoxgloveServer::advertise(Feed& feed, const std::string& sensor) {
  std::vector<foxglove::Channel> added;
  for (const auto& type : foxglove::kChannelTypes) {
    // The endpoint 'latest' has fields only.
    if (feed.options.subscription.mode == Mode::kLatest && (type.kind & (foxglove::kFields | foxglove::kLogs)) == 0) {
      continue;
    }
    const auto id = static_cast<std::uint32_t>(channels_.size());
    std::string topic = foxglove::topicOf(sensor, type);
    if (!ids_.emplace(topic, id).second) {
      conflicts_.push_back("two endpoints publish a sensor '" + sensor +
                           "', and only the first one's messages are shown: " +
                           "give each sensor a name of its own, sensor.name in its tractiond.toml");
      return tellAll(foxglove::status(Level::kError, conflicts_.back()));
    }
    channels_.push_back({.channel = {id, std::move(topic), type.schemaName, foxglove::schemaOf(type)},
                         .feed = &feed,
                         .kind = type.kind,
                         .lasting = {},
                         .lines = {}});
    added.push_back(channels_.back().channel);
  }
  tellAll(foxglove::advertise(added));
}

/// Reports an error of an endpoint to all clients, unless it is the one that was reported last.
void FoxgloveServer::tellError(Feed& feed, const std::string& what) {
  const std::string text = feed.options.name + ": " + what;
  feed.failed = Clock::now();
  if (feed.error == text) return;
  feed.error = text;
  tellAll(foxglove::status(Level::kError, text, "endpoint-" + std::to_string(feed.number)));
}

void FoxgloveServer::tellAll(const std::string& text) {
  const auto all = sessions_;  // a copy: a session that takes no texts is closed and removed
  for (const auto& session : all) session->tell(text);
}

}  // namespace traction::view
