#include "client/viewer/listen_address.h"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <algorithm>
#include <charconv>
#include <regex>

namespace traction::view {

using boost::asio::ip::tcp;
using boost::system::error_code;

std::optional<ListenAddress> parseListenAddress(const std::string& text, const ListenAddress& defaults) {
  static const std::regex kForms(R"((\d+)|(?:\[([^\]]+)\]|([^:]+))(?::(\d+))?|(.*:.*:.*))");
  std::smatch match;
  if (!std::regex_match(text, match, kForms)) return std::nullopt;
  ListenAddress result = defaults;
  if (!match[1].matched) result.address = match[2].str() + match[3].str() + match[5].str();
  const std::string port = match[1].str() + match[4].str();
  if (!port.empty() && std::from_chars(port.data(), port.data() + port.size(), result.port).ec != std::errc())
    return std::nullopt;
  return result;
}

std::string resolved(const std::string& address) {
  boost::asio::io_context context;
  error_code error;
  const auto found = tcp::resolver(context).resolve(address, "", error);
  std::vector<boost::asio::ip::address> all;
  for (const auto& one : found) all.push_back(one.endpoint().address());
  if (address.empty() || all.empty()) return {};
  return std::min_element(all.begin(), all.end(),
                          [](const auto& one, const auto& other) { return one.is_v4() > other.is_v4(); })
      ->to_string();
}

bool isLoopback(const std::string& address) {
  error_code error;
  const auto parsed = boost::asio::ip::make_address(address, error);
  return !error && parsed.is_loopback();
}

bool isAllowedHost(std::string_view host, const std::vector<std::string>& names) {
  if (!host.empty() && host.front() == '[') {
    const std::size_t end = host.find(']');
    host = end == std::string_view::npos ? std::string_view() : host.substr(1, end - 1);
  } else {
    host = host.substr(0, host.find(':'));
  }
  error_code error;
  boost::asio::ip::make_address(std::string(host), error);
  return !error || host == "localhost" || std::find(names.begin(), names.end(), host) != names.end();
}

}  // namespace traction::view
