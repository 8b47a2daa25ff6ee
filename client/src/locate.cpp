#include "client/src/locate.h"

#include "base/directory.h"

#include <sys/stat.h>
#include <unistd.h>

namespace traction {

namespace {

/// \throws Error if another user may control a runtime directory
void checkControl(const std::filesystem::path& directory) {
  if (!tractiond::canOthersControl(directory)) return;
  throw Error(ErrorCode::kBadEndpoint,
              "the runtime directory " + directory.string() +
                  " cannot be used: another user may control it, as every user can write into it or a directory above; "
                  "set XDG_RUNTIME_DIR to a directory of your own");
}

}  // namespace

std::vector<Endpoints> locate(const std::string& instance, std::string_view program) {
  if (!isValidName(instance)) {
    throw Error(ErrorCode::kBadEndpoint, "'" + instance + "' is not an instance's name: 1 to 24 of A-Z a-z 0-9 _ -");
  }
  std::vector<Endpoints> possible;
  for (const auto& directory : runtimeDirectories(instance, program)) {
    std::error_code ignored;
    const auto stream = directory / "stream";
    // Only the service's group may open the sockets of a service.
    const bool open = std::filesystem::is_socket(stream, ignored) && access(stream.c_str(), W_OK) == 0;
    if (open) {
      checkControl(directory);
      return {ipcEndpoints(directory)};
    }
    possible.push_back(ipcEndpoints(directory));
  }
  if (instance != kDefaultInstance) {
    const auto own = runtimeDirectories(instance, program).front(), folder = own.parent_path();
    struct stat above {};
    // Otherwise another user could make it later.
    if (stat(folder.parent_path().c_str(), &above) == 0 && tractiond::canOthersWrite(above))
      mkdir(folder.c_str(), 0700);
    checkControl(own);
    return possible;
  }
  if (program == kTouch) return {touchTcpEndpoints()};
  Endpoints tcp = tcpEndpoints();
  tcp.control = possible.back().control;
  return {tcp};
}

Error badEndpoint(const std::string& endpoint, const std::string& why) {
  return {ErrorCode::kBadEndpoint,
          "cannot connect to '" + endpoint + "': " + why + "; an endpoint is written tcp://HOST:PORT or ipc:///PATH"};
}

}  // namespace traction
