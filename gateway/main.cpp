// traction-gateway: parses the arguments, runs, and returns the exit code.
#include "base/directory.h"
#include "gateway/arguments.h"
#include "gateway/serve.h"
#include "proto/traction/v1/endpoints.h"

#include <filesystem>
#include <iostream>
#include <new>

namespace {

using namespace tractiond;
using namespace tractiond::gateway;
namespace fs = std::filesystem;

/// Returns the runtime directory of the instance's sockets; the system's if there are none yet. EX_NOPERM: another user
/// may control it.
tl::expected<fs::path, Error> runtimeOf(const Arguments& arguments) {
  if (!arguments.runtime.empty()) return fs::absolute(arguments.runtime);
  const auto candidates = traction::runtimeDirectories(arguments.instance);
  for (const fs::path& directory : candidates) {
    std::error_code ignored;
    if (!fs::is_socket(directory / "stream", ignored)) continue;
    if (!canOthersControl(directory)) return directory;
    return tl::unexpected(Error{.exitCode = EX_NOPERM,
                                .what = "the runtime directory " + directory.string() +
                                        " cannot be used: another user may control it, "
                                        "as every user can write into it or a directory above",
                                .remedy = "choose another with --runtime"});
  }
  return candidates.back();
}

}  // namespace

int main(int argc, char** argv) try {
  auto arguments = parseArguments(argc, argv);
  if (!arguments) return arguments.error();
  const fs::path standard = fs::path("/etc/tractiond/gateway") / (arguments->instance + ".toml");
  std::error_code absent;
  if (arguments->config.empty() && fs::exists(standard, absent)) arguments->config = standard;
  const auto config = arguments->config.empty() ? tl::expected<Config, Error>() : loadConfig(arguments->config);
  if (!config) return failed(config.error());
  if (arguments->printConfig) return std::cout << configText(*config), EX_OK;
  if (arguments->checkConfig) return EX_OK;
  const auto runtime = runtimeOf(*arguments);
  return runtime ? serve(*config, *runtime, arguments->config.empty() ? standard : arguments->config)
                 : failed(runtime.error());
} catch (const std::bad_alloc&) {
  return failed({.exitCode = EX_OSERR, .what = "there is no memory left", .remedy = "see MemoryMax= of the service"});
} catch (const std::exception& error) {
  return failed({.exitCode = EX_OSERR, .what = error.what()});
}
