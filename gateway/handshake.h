// Authentication of peers: answers ZeroMQ's authentication protocol (ZAP, RFC 27), which asks once per handshake.
#pragma once

#include "base/network/keys.h"

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::gateway {

/// Returns the allowed key equal to `key` (40 characters of Z85), or null if it is not allowed. The result must be
/// valid until answerHandshake() returns.
using MayEnter = std::function<const network::AllowedKey*(const std::string& key)>;

/// ZAP domains of the control and preview sockets, which need network::Permission::kControl; all others need kRead.
inline constexpr std::string_view kControlDomain = "control", kPreviewDomain = "preview";

struct HandshakeAnswer {
  /// Version, request id, status code ("200": admitted, "400": refused), status text, user (the key's name), metadata
  /// (empty).
  std::array<std::string, 6> parts;
  std::string refused;  ///< peer and reason, for the log; empty: admitted
};

/// Returns the answer to one request: admits a CURVE key that is allowed and has the permission of the domain, refuses
/// all others. Reentrant.
/// \param request version, request id, domain, address, routing id, mechanism, key (32 bytes); any other shape is
/// refused
/// \param mayEnter not called if the request has another shape or mechanism
HandshakeAnswer answerHandshake(std::vector<std::string> request, const MayEnter& mayEnter);

}  // namespace tractiond::gateway
