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
using foxglove::Sample;
using namespace std::chrono_literals;

/// An endpoint's last error is sent to new clients, and not repeated to the others, for this long.
constexpr auto kErrorLasts = 10s;
constexpr std::size_t kMostClients = 16;

}  // namespace

FoxgloveServer::FoxgloveServer(asio::io_context& context, const FoxgloveOptions& options,
                               const std::vector<std::string>& hostNames, const std::vector<std::unique_ptr<Hub>>& hubs,
                               Need need)
    : options_(options)
    , listener_(context, options.listen, "--foxglove", hostNames,
                [this](const Request& request, const auto& take) { return handle(request, take); })
    , need_(std::move(need))
    , session_(std::to_string(getpid()) + "-" + std::to_string(Clock::now().time_since_epoch().count()))
    , feeds_(hubs.size()) {
  for (std::size_t i = 0; i < hubs.size(); ++i) {
    Feed& feed = feeds_[i];
    feed.hub = hubs[i].get();
    feed.hub->converter = std::make_unique<foxglove::Converter>([this, &context, &feed](const Sample& sample) {
      asio::post(context, [this, &feed, sample] { deliver(feed, sample); });
    });
  }
}

std::optional<Response> FoxgloveServer::handle(const Request& request, const std::function<tcp::socket()>& take) {
  const auto refuse = [&](http::status status, const std::string& why) { return refusalOf(request, status, why); };
  const std::string origin(headerOf(request, http::field::origin));
  if (!foxglove::isAllowedOrigin(origin, options_.origins)) {
    const std::string shown = origin.substr(0, 200);
    printRefusal("refused a Foxglove connection by a page of the origin '" + shown + "'" +
                 (shown == "null"
                      ? ""  // of any sandboxed page
                      : "; if it is a Foxglove or Lichtblick of your own, allow it with --foxglove-origin " + shown));
    return refuse(http::status::forbidden,
                  "Pages of this origin are refused; traction-view --foxglove-origin ORIGIN allows one.");
  }
  if (!beast::websocket::is_upgrade(request)) {
    return refuse(http::status::upgrade_required,
                  "This is a Foxglove WebSocket: in Foxglove or Lichtblick, choose Open connection.");
  }
  const std::string_view subprotocol =
      foxglove::chooseSubprotocol(headerOf(request, http::field::sec_websocket_protocol));
  if (subprotocol.empty()) {
    return refuse(http::status::bad_request,
                  "The subprotocol must be foxglove.sdk.v1 or foxglove.websocket.v1 (Sec-WebSocket-Protocol).");
  }
  if (sessions_.size() >= kMostClients)
    return refuse(http::status::service_unavailable, "Too many clients are connected.");
  open(request, subprotocol, take());
  return std::nullopt;
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
  for (const Feed& feed : feeds_) {
    if (!feed.error.empty() && Clock::now() - feed.failed < kErrorLasts)
      greeting.push_back(foxglove::errorStatus(feed.error));
  }
  for (const std::string& each : conflicts_) greeting.push_back(foxglove::errorStatus(each));
  sessions_.push_back(session);
  for (ChannelState& each : channels_) {
    if (!each.feed->hub->source) each.lasting.clear();  // of long ago
  }
  for (const Feed& feed : feeds_) need_(*feed.hub, kAllTopics | kContacts);
  session->start(request, subprotocol, std::move(greeting));
}

std::string FoxgloveServer::subscribe(foxglove::Session& session, std::uint32_t channel) {
  if (channel >= channels_.size()) return "there is no such channel";
  ChannelState& state = channels_[channel];
  ++state.subscribers;
  update(*state.feed);
  for (const auto& [slot, sample] : state.lasting) session.offer(channel, sample);
  return {};
}

void FoxgloveServer::unsubscribe(std::uint32_t channel) {
  ChannelState& state = channels_.at(channel);
  --state.subscribers;
  update(*state.feed);
}

void FoxgloveServer::update(const Feed& feed) {
  unsigned kinds = 0;
  for (const ChannelState& each : channels_) {
    if (each.feed == &feed && each.subscribers > 0) kinds |= each.kind;
  }
  feed.hub->converter->want(kinds);
  if ((kinds & foxglove::kOfPreviews) != 0) need_(*feed.hub, kPreview);
}

void FoxgloveServer::deliver(Feed& feed, const Sample& sample) {
  if (feed.sensors.insert(sample.sensor).second) advertise(feed, sample.sensor);
  const auto* type = std::find_if(foxglove::kChannelTypes.begin(), foxglove::kChannelTypes.end(),
                                  [&](const auto& each) { return each.kind == sample.kind; });
  const auto found = ids_.find(foxglove::topicOf(sample.sensor, *type));
  if (found == ids_.end()) return;
  ChannelState& state = channels_[found->second];
  if (state.feed != &feed) return;
  if (sample.isLasting) state.lasting[sample.slot] = sample;
  if (state.subscribers == 0) return;
  for (const auto& session : sessions_) session->offer(state.channel.id, sample);
}

void FoxgloveServer::advertise(Feed& feed, const std::string& sensor) {
  std::vector<foxglove::Channel> added;
  for (const auto& type : foxglove::kChannelTypes) {
    // The endpoint 'latest' has fields only.
    if (feed.hub->options.subscription.mode == Mode::kLatest &&
        (type.kind & (unsigned{kField} | foxglove::kLogs)) == 0) {
      continue;
    }
    const auto id = static_cast<std::uint32_t>(channels_.size());
    std::string topic = foxglove::topicOf(sensor, type);
    if (!ids_.emplace(topic, id).second) {
      conflicts_.push_back("two endpoints publish a sensor '" + sensor +
                           "', and only the first one's messages are shown: " +
                           "give each sensor a name of its own, sensor.name in its tractiond.toml");
      return tellAll(foxglove::errorStatus(conflicts_.back()));
    }
    channels_.push_back({.channel = {id, std::move(topic), type.schemaName, foxglove::schemaOf(type)},
                         .feed = &feed,
                         .kind = type.kind,
                         .lasting = {}});
    added.push_back(channels_.back().channel);
  }
  tellAll(foxglove::advertise(added));
}

void FoxgloveServer::tellError(const Hub& hub, const std::string& what) {
  const auto feed = std::find_if(feeds_.begin(), feeds_.end(), [&](const Feed& each) { return each.hub == &hub; });
  const std::string text = hub.options.name + ": " + what;
  const bool isKnown = feed->error == text && Clock::now() - feed->failed < kErrorLasts;
  feed->failed = Clock::now();
  feed->error = text;
  if (!isKnown) tellAll(foxglove::errorStatus(text, "endpoint-" + std::to_string(feed - feeds_.begin())));
}

void FoxgloveServer::tellAll(const std::string& text) {
  for (const auto& session : sessions_) session->tell(text);
}

}  // namespace traction::view
