// Tells on standard error which requests a server refuses, as a browser only reports that the connection failed.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <string_view>

namespace traction::view {

/// Returns a header of a request as it can be printed: at most 200 characters, '?' for what would control a terminal.
std::string printableHeader(std::string_view text);

/// Prints each line once, and 16 at most: web pages choose what is in them. Thread-bound.
class Refusals {
 public:
  /// \param line complete sentence without the program's name; its headers printableHeader()
  void print(const std::string& line);

 private:
  static constexpr std::size_t kMost = 16;
  std::set<std::string> printed_;
};

/// Returns why a request is refused whose Host header is neither an IP address nor a known name of this host.
std::string unknownHost(std::string_view host);

/// Returns why a page's request is refused whose Origin is not the server that its Host header names.
std::string otherOrigin(std::string_view origin, std::string_view host);

}  // namespace traction::view
