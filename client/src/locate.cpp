#include "client/src/locate.h"

#include <unistd.h>

namespace traction {

std::vector<Endpoints> locate(const std::string& instance) {
  if (!isValidName(instance)) {
    throw Error(ErrorCode::kBadEndpoint, "'" + instance + "' is not an instance's name: 1 to 24 of A-Z a-z 0-9 _ -");
  }
  std::vector<Endpoints> possible;
  for (const auto& directory : runtimeDirectories(instance)) {
    std::error_code ignored;
    const auto stream = directory / "stream";
    // Only the service's group may open the sockets of a service.
    const bool open = std::filesystem::is_socket(stream, ignored) && access(stream.c_str(), W_OK) == 0;
    if (open) return {ipcEndpoints(directory)};
    possible.push_back(ipcEndpoints(directory));
  }
  if (instance != kDefaultInstance) return possible;
  Endpoints tcp = tcpEndpoints();
  tcp.control = possible.back().control;
  return {tcp};
}

Error badEndpoint(const std::string& endpoint, const std::string& why) {
  return {ErrorCode::kBadEndpoint,
          "cannot connect to '" + endpoint + "': " + why + "; an endpoint is written tcp://HOST:PORT or ipc:///PATH"};
}

}  // namespace traction
