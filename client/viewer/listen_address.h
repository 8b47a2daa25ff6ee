// Addresses that the viewer's servers listen at, and the hosts that belong to them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace traction::view {

struct ListenAddress {
  std::string address = "127.0.0.1";  ///< IPv4 or IPv6, without brackets
  std::uint16_t port = 0;             ///< 0: any free port
};

/// Parses ADDRESS:PORT, ADDRESS, PORT or [IPV6]:PORT; the part that is left out with its colon is taken from
/// `defaults`. Whether ADDRESS is an IP address is not checked.
/// \return empty if the text has none of these forms, or its port is not a number from 0 to 65535
std::optional<ListenAddress> parseListenAddress(const std::string& text, const ListenAddress& defaults);

/// Returns the IP address that a name stands for, an IPv4 one before an IPv6 one; an IP address itself; empty for a
/// name that is not known. Looks names up, which may wait for a server.
std::string resolved(const std::string& address);

/// Returns whether `address` is an IPv4 address in 127.0.0.0/8 or ::1. False for any other text, also "localhost" and
/// IPv4 addresses written as IPv6.
bool isLoopback(const std::string& address);

/// Returns whether a request's Host header may be meant for this server: any IP address (IPv6 in brackets), localhost,
/// or one of `names`, compared letter by letter, with or without a port. Any other name could be an attacker's that
/// resolves to this host (DNS rebinding).
bool isAllowedHost(std::string_view host, const std::vector<std::string>& names);

}  // namespace traction::view
