// traction-gateway: parses the arguments, runs, and returns the exit code.
#include "base/counter.h"
#include "base/network/connection_limit.h"
#include "base/service/log.h"
#include "base/service/service.h"
#include "gateway/arguments.h"
#include "gateway/config.h"
#include "gateway/relay.h"
#include "proto/traction/v1/endpoints.h"

#include <pthread.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <atomic>
#include <filesystem>
#include <iostream>
#include <new>
#include <thread>

namespace {

using namespace tractiond;
using namespace tractiond::gateway;
namespace fs = std::filesystem;

std::string line(const Error& error) {
  return logLine("traction-gateway", spdlog::level::err, error.message());
}

int failed(const Error& error) {
  std::cerr << line(error) << "\n";
  return error.exitCode;
}

/// Returns the runtime directory of the instance's sockets; the system's if there are none yet.
fs::path runtimeOf(const Arguments& arguments) {
  if (!arguments.runtime.empty()) return fs::absolute(arguments.runtime);
  const auto candidates = traction::runtimeDirectories(arguments.instance);
  for (const fs::path& directory : candidates) {
    std::error_code ignored;
    if (fs::is_socket(directory / "stream", ignored)) return directory;
  }
  return candidates.back();
}

/// Checks that the limit on file descriptors allows the configured number of peers. Error: EX_OSERR.
tl::expected<void, Error> checkDescriptors(const Config& config) {
  constexpr rlim_t kOwn = 72;  // open by the gateway itself
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const rlim_t needed = static_cast<rlim_t>(config.limits.peers) + network::connections::kReserved + kOwn;
  if (limit.rlim_cur >= needed) return {};
  return tl::unexpected(Error{.exitCode = EX_OSERR,
                              .what = "limits.peers = " + std::to_string(config.limits.peers) + " takes " +
                                      std::to_string(needed) + " file descriptors, and " +
                                      std::to_string(limit.rlim_cur) + " are allowed",
                              .remedy = "allow more (LimitNOFILE= of the service, ulimit -n), or fewer peers"});
}

int serve(const Config& config, const fs::path& runtime) {
  catchSignals();
  if (const auto raised = raiseDescriptorLimit(); !raised) return failed(raised.error());
  if (const auto enough = checkDescriptors(config); !enough) return failed(enough.error());
  const auto log = startLog("traction-gateway", config.logLevel);
  auto relay = Relay::open(config, runtime);
  if (!relay) return log->write(line(relay.error())), relay.error().exitCode;
  for (const Way way : {kStream, kLatest, kControl, kPreview}) {
    for (const std::string& endpoint : (*relay)->bound(way)) spdlog::info("listening at {}", endpoint);
  }
  Counter turns;
  std::atomic<bool> ended{false};
  tl::expected<void, Error> result;
  std::jthread thread([&](const std::stop_token& stop) {
    pthread_setname_np(pthread_self(), "tr-relay");
    while (result && !stop.stop_requested()) {
      constexpr std::chrono::milliseconds kTurn(100);
      result = (*relay)->turn(kTurn);
      turns.add();
    }
    ended = true;
  });
  run({.loops = {&turns},
       .ended = [&] { return ended.load(); },
       .statusLine = [&] { return std::to_string((*relay)->peers()) + " connections"; },
       .reload = [] { spdlog::info("keys are looked at all the time; the configuration wants a restart"); }});
  thread.request_stop();
  thread.join();
  if (!result) return log->write(line(result.error())), result.error().exitCode;
  spdlog::info("stopped");
  return EX_OK;
}

}  // namespace

int main(int argc, char** argv) try {
  auto arguments = parseArguments(argc, argv);
  if (!arguments) return arguments.error();
  if (arguments->config.empty()) {
    const fs::path standard = fs::path("/etc/tractiond/gateway") / (arguments->instance + ".toml");
    std::error_code absent;
    if (fs::exists(standard, absent)) arguments->config = standard;
  }
  const auto config = arguments->config.empty() ? tl::expected<Config, Error>() : loadConfig(arguments->config);
  if (!config) return failed(config.error());
  if (arguments->printConfig) return std::cout << configText(*config), EX_OK;
  return arguments->checkConfig ? EX_OK : serve(*config, runtimeOf(*arguments));
} catch (const std::bad_alloc&) {
  return failed({.exitCode = EX_OSERR, .what = "there is no memory left", .remedy = "see MemoryMax= of the service"});
} catch (const std::exception& error) {
  return failed({.exitCode = EX_OSERR, .what = error.what()});
}
