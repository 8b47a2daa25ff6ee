#include "client/viewer/listen_address.h"

#include <arpa/inet.h>
#include <netdb.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>

namespace traction::view {

namespace {

std::optional<std::uint16_t> parsePort(std::string_view digits) {
  std::uint16_t port = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  if (digits.empty() || error != std::errc() || end != digits.data() + digits.size()) return std::nullopt;
  return port;
}

/// Returns an address in network byte order: 4 or 16 bytes; empty if the text is not an IP address.
std::string bytesOf(const std::string& address) {
  std::string bytes(sizeof(in6_addr), '\0');
  if (inet_pton(AF_INET6, address.c_str(), bytes.data()) == 1) return bytes;
  bytes.resize(sizeof(in_addr));
  return inet_pton(AF_INET, address.c_str(), bytes.data()) == 1 ? bytes : std::string();
}

}  // namespace

std::optional<ListenAddress> parseListenAddress(const std::string& text, const ListenAddress& defaults) {
  ListenAddress result = defaults;
  const auto setPort = [&](std::string_view digits) {
    const auto port = parsePort(digits);
    result.port = port.value_or(0);
    return port.has_value();
  };
  if (text.find_first_not_of("0123456789") == std::string::npos) {
    return setPort(text) ? std::optional(result) : std::nullopt;
  }
  const std::size_t colon = text.rfind(':');
  const bool hasPort = colon != std::string::npos && (text.find(':') == colon || (colon > 0 && text[colon - 1] == ']'));
  result.address = text.substr(0, hasPort ? colon : std::string::npos);
  if (result.address.size() > 2 && result.address.front() == '[' && result.address.back() == ']') {
    result.address = result.address.substr(1, result.address.size() - 2);
  }
  if (hasPort && !setPort(std::string_view(text).substr(colon + 1))) return std::nullopt;
  return result;
}

std::string resolved(const std::string& address) {
  if (!bytesOf(address).empty()) return address;
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (address.empty() || getaddrinfo(address.c_str(), nullptr, &hints, &found) != 0) return {};
  std::string first;
  for (const int family : {AF_INET, AF_INET6}) {
    for (const addrinfo* one = found; one != nullptr && first.empty(); one = one->ai_next) {
      std::array<char, NI_MAXHOST> text{};
      if (one->ai_family == family &&
          getnameinfo(one->ai_addr, one->ai_addrlen, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) == 0)
        first = text.data();
    }
  }
  freeaddrinfo(found);
  return first;
}

bool isLoopback(const std::string& address) {
  const std::string bytes = bytesOf(address);
  constexpr char kLoopbackNet = 127;
  if (bytes.size() == sizeof(in_addr)) return bytes.front() == kLoopbackNet;
  constexpr std::string_view kLoopback("\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\1", sizeof(in6_addr));
  return bytes == kLoopback;
}

bool isAllowedHost(std::string_view host, const std::vector<std::string>& names) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    host = end == std::string_view::npos ? std::string_view() : host.substr(1, end - 1);
  } else {
    host = host.substr(0, host.find(':'));
  }
  return !bytesOf(std::string(host)).empty() || host == "localhost" ||
         std::find(names.begin(), names.end(), host) != names.end();
}

}  // namespace traction::view
