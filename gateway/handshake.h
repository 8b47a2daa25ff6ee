// Authentication of peers: answers ZeroMQ's authentication protocol (ZAP, RFC 27), which asks once per handshake.
#pragma once

#include "base/network/keys.h"

#include <array>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace tractiond::gateway {

/// Returns the allowed key equal to `key`, or null if it is not allowed.
using MayEnter = std::function<const network::AllowedKey*(const std::string& key)>;

/// ZAP domains of the control and preview sockets, which need network::Permission::kControl; all others need kRead.
inline constexpr std::string_view kControlDomain = "control", kPreviewDomain = "preview";

struct HandshakeAnswer {
  /// version, request id, status code, status text, user, metadata
  std::array<std::string, 6> parts;
  std::string refused;  ///< peer and reason, for the log; empty: admitted
};

/// Answers one request. \param request version, request id, domain, address, routing id, mechanism, key; any other
/// shape is rejected
HandshakeAnswer answerHandshake(std::vector<std::string> request, const MayEnter& mayEnter);

}  // namespace tractiond::gateway
