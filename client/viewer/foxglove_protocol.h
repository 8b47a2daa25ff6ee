// The messages of the Foxglove WebSocket protocol, version 1, as text and bytes. Knows no sockets.
//
// Specification: https://github.com/foxglove/ws-protocol, docs/spec.md (until commit 8e2a044), subprotocol
// foxglove.websocket.v1; foxglove.sdk.v1 of https://github.com/foxglove/foxglove-sdk has the same messages.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace traction::view::foxglove {

/// A channel that the server offers. The texts that it refers to must outlive it.
struct Channel {
  std::uint32_t id = 0;
  std::string topic;
  std::string_view schemaName;  ///< of a Protobuf message
  std::string_view schema;      ///< FileDescriptorSet that defines it
};

// Sent by clients.

struct Subscription {
  std::uint32_t id = 0;       ///< chosen by the client
  std::uint32_t channel = 0;  ///< Channel::id; it may not exist
};
struct Subscribe {
  std::vector<Subscription> subscriptions;
};
struct Unsubscribe {
  std::vector<std::uint32_t> ids;  ///< of subscriptions
};
/// A message that is malformed or asks for something that is not offered.
struct Refused {
  std::string why;  ///< for the user of the client
};
using ClientMessage = std::variant<Subscribe, Unsubscribe, Refused>;

/// Parses a text message. Never fails: what cannot be understood or is not offered is Refused, as a whole. Whether the
/// ids exist is not checked. Reentrant.
ClientMessage parseText(std::string_view text);

// Sent by the server.

/// Returns the text message serverInfo, the first one of a connection.
/// \param session identifies this start of the program; channel ids keep their meaning as long as it stays the same
/// \param name shown to users; escaped, and what is not UTF-8 is replaced
std::string serverInfo(const std::string& name, const std::string& session);
/// Returns the text message that advertises the channels, whose messages are Protobuf.
std::string advertise(const std::vector<Channel>& channels);
/// Returns the text message that shows `message` to the client's user, as an error.
/// \param id if it is not empty, a later status with the same id replaces this one
std::string errorStatus(const std::string& message, const std::string& id = "");

inline constexpr std::size_t kDataHeaderSize = 13;
/// Returns the bytes of the binary message MessageData that precede the payload: 1, then both numbers, little endian.
/// \param subscription Subscription::id of the client that receives them
/// \param logTime_ns ns since 1970
std::array<char, kDataHeaderSize> dataHeader(std::uint32_t subscription, std::uint64_t logTime_ns);

// The handshake.

/// Chooses the subprotocol from a header Sec-WebSocket-Protocol ("a, b"): foxglove.sdk.v1 before foxglove.websocket.v1;
/// empty if none is supported. The result lives as long as the program.
std::string_view chooseSubprotocol(std::string_view offered);

/// Returns whether a page of this origin may connect: no origin (not a browser), Foxglove's or Lichtblick's web app,
/// any origin of the schemes file, app, foxglove and lichtblick (desktop apps), or one of `allowed`, compared letter by
/// letter ("https://example.org"). Any web page could reach a server on the loopback.
bool isAllowedOrigin(std::string_view origin, const std::vector<std::string>& allowed);

}  // namespace traction::view::foxglove
