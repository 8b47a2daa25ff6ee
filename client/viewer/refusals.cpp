#include "client/viewer/refusals.h"

#include <algorithm>
#include <iostream>

namespace traction::view {

std::string printableHeader(std::string_view text) {
  constexpr std::size_t kLongest = 200;
  std::string shown(text.substr(0, kLongest));
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char byte) { return byte < 0x20 || byte > 0x7E; }, '?');
  return shown;
}

void Refusals::print(const std::string& line) {
  if (printed_.size() < kMost && printed_.insert(line).second) std::cerr << "traction-view: " << line << std::endl;
}

std::string unknownHost(std::string_view host) {
  const std::string name = printableHeader(host.substr(0, host.find(':')));
  return "refused a request to the host '" + printableHeader(host) +
         "', which is not known as this one; if it is, allow it with --name " + (name.empty() ? "HOST" : name);
}

std::string otherOrigin(std::string_view origin, std::string_view host) {
  return "refused a request of a page of '" + printableHeader(origin) + "' to the host '" + printableHeader(host) +
         "' (headers Origin and Host): they must be the same. A proxy must pass on the Host that the browser sent, "
         "with "
         "its port (nginx: proxy_set_header Host $http_host)";
}

}  // namespace traction::view
