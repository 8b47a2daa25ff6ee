// Who comes in: ZeroMQ's authentication protocol (ZAP, RFC 27), of which ZeroMQ asks about each handshake.
#pragma once

#include "gateway/keys.h"

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::gateway {

/// Asks who may come in with a key. Null: nobody.
using MayEnter = std::function<const AllowedKey*(const std::string& key)>;

/// The domains of requests and of pictures, for which a key must be allowed control; every other is for readers.
inline constexpr std::string_view kControlDomain = "control", kPreviewDomain = "preview";

struct HandshakeAnswer {
  /// version, request id, status code, status text, user, metadata
  std::array<std::string, 6> parts;
  std::string refused;  ///< for people: whom, and why; empty: let in
};

/// `request`: version, request id, domain, address, routing id, mechanism, key. Whatever else it is, it is refused.
HandshakeAnswer answerHandshake(std::vector<std::string> request, const MayEnter& mayEnter);

}  // namespace tractiond::gateway
