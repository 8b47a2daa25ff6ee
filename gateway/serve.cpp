#include "gateway/serve.h"

#include "base/counter.h"
#include "base/network/socket_file.h"
#include "base/service/log.h"
#include "base/service/service.h"
#include "gateway/relay.h"

#include <pthread.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <iostream>
#include <thread>

namespace tractiond::gateway {

int failed(const Error& error) {
  std::cerr << logLine("traction-gateway", spdlog::level::err, error.message()) << "\n";
  return error.exitCode;
}

int serve(const Config& config, const std::filesystem::path& runtime, const std::filesystem::path& file) {
  catchSignals();
  if (const auto raised = raiseDescriptorLimit(); !raised) return failed(raised.error());
  const Log log("traction-gateway", config.logLevel);
  auto relay = Relay::open(config, runtime);
  if (!relay) {
    Error error = relay.error();
    if (network::isInUse(error))
      error.remedy =
          "is another traction-gateway running? Each needs endpoints of its own: section [gateway] of " + file.string();
    return spdlog::error("{}", error.message()), error.exitCode;
  }
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
       .statusLine =
           [&] {
             return std::string((*relay)->isSilent() ? "nothing comes from the instrument" : "relays the instrument");
           },
       .reload = []() -> std::function<void()> {
         return [] { spdlog::info("keys are looked at all the time; the configuration wants a restart"); };
       }});
  thread.request_stop();
  thread.join();
  if (!result) return spdlog::error("{}", result.error().message()), result.error().exitCode;
  spdlog::info("stopped");
  return EX_OK;
}

}  // namespace tractiond::gateway
