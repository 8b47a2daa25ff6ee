#include "client/viewer/foxglove_protocol.h"

#include "client/show/base64.h"

#include <boost/beast/http/rfc7230.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <optional>

namespace traction::view::foxglove {

namespace {

using Json = nlohmann::json;

/// Web apps; Lichtblick's is hosted on GitHub's pages. Desktop apps load their page from a file or by a scheme of their
/// own, which a web page cannot have.
constexpr std::array<std::string_view, 3> kOrigins = {"https://app.foxglove.dev", "https://studio.foxglove.dev",
                                                      "https://lichtblick-suite.github.io"};
constexpr std::array<std::string_view, 4> kAppSchemes = {"file://", "app://", "foxglove://", "lichtblick://"};

std::optional<std::uint32_t> idOf(const Json& value) {
  if (!value.is_number_unsigned()) return std::nullopt;
  const auto number = value.get<std::uint64_t>();
  if (number > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

ClientMessage parseSubscribe(const Json& message) {
  const auto list = message.find("subscriptions");
  if (list == message.end() || !list->is_array()) return Refused{"subscribe: 'subscriptions' is not an array"};
  Subscribe result;
  for (const Json& each : *list) {
    if (!each.is_object()) return Refused{"subscribe: a subscription is not an object"};
    const auto id = idOf(each.value("id", Json())), channel = idOf(each.value("channelId", Json()));
    if (!id || !channel) return Refused{"subscribe: 'id' and 'channelId' must be integers from 0 to 2^32 - 1"};
    result.subscriptions.push_back({*id, *channel});
  }
  return result;
}

ClientMessage parseUnsubscribe(const Json& message) {
  const auto list = message.find("subscriptionIds");
  if (list == message.end() || !list->is_array()) return Refused{"unsubscribe: 'subscriptionIds' is not an array"};
  Unsubscribe result;
  for (const Json& each : *list) {
    const auto id = idOf(each);
    if (!id) return Refused{"unsubscribe: 'subscriptionIds' must be integers from 0 to 2^32 - 1"};
    result.ids.push_back(*id);
  }
  return result;
}

/// Writes JSON, and replaces bytes that are not UTF-8: error messages may quote bytes that clients sent.
std::string dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

ClientMessage parseText(std::string_view text) {
  const Json message = Json::parse(text, nullptr, false);
  if (message.is_discarded()) return Refused{"the message is not JSON"};
  const auto op = message.is_object() ? message.find("op") : message.end();
  if (op == message.end() || !op->is_string()) return Refused{"the message is not a JSON object with a string 'op'"};
  const auto& name = op->get_ref<const std::string&>();
  if (name == "subscribe") return parseSubscribe(message);
  if (name == "unsubscribe") return parseUnsubscribe(message);
  return Refused{"unknown op '" + name.substr(0, 40) + "': this server only publishes"};
}

std::string serverInfo(const std::string& name, const std::string& session) {
  return dump({{"op", "serverInfo"}, {"name", name}, {"capabilities", Json::array()}, {"sessionId", session}});
}

std::string advertise(const std::vector<Channel>& channels) {
  Json list = Json::array();
  for (const Channel& channel : channels) {
    list.push_back({{"id", channel.id},
                    {"topic", channel.topic},
                    {"encoding", "protobuf"},
                    {"schemaName", channel.schemaName},
                    {"schemaEncoding", "protobuf"},
                    {"schema", client::base64(channel.schema)}});
  }
  return dump({{"op", "advertise"}, {"channels", list}});
}

std::string errorStatus(const std::string& message, const std::string& id) {
  Json result = {{"op", "status"}, {"level", 2}, {"message", message}};
  if (!id.empty()) result["id"] = id;
  return dump(result);
}

std::array<char, kDataHeaderSize> dataHeader(std::uint32_t subscription, std::uint64_t logTime_ns) {
  static_assert(std::endian::native == std::endian::little);
  std::array<char, kDataHeaderSize> header{1};
  std::memcpy(header.data() + 1, &subscription, sizeof subscription);
  std::memcpy(header.data() + 5, &logTime_ns, sizeof logTime_ns);
  return header;
}

std::string_view chooseSubprotocol(std::string_view offered) {
  boost::beast::http::token_list list(boost::beast::string_view(offered.data(), offered.size()));
  for (const char* mine : {"foxglove.sdk.v1", "foxglove.websocket.v1"}) {
    if (list.exists(mine)) return mine;
  }
  return {};
}

bool isAllowedOrigin(std::string_view origin, const std::vector<std::string>& allowed) {
  return origin.empty() || std::find(kOrigins.begin(), kOrigins.end(), origin) != kOrigins.end() ||
         std::any_of(kAppSchemes.begin(), kAppSchemes.end(),
                     [&](std::string_view scheme) { return origin.starts_with(scheme); }) ||
         std::find(allowed.begin(), allowed.end(), origin) != allowed.end();
}

}  // namespace traction::view::foxglove
