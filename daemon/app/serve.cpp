#include "daemon/app/serve.h"

#include "base/network/socket_file.h"
#include "base/service/log.h"
#include "base/service/service.h"
#include "daemon/app/adoption.h"
#include "daemon/app/config.h"
#include "daemon/app/instrument.h"
#include "daemon/app/reload.h"
#include "daemon/app/replay.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

namespace tractiond {
namespace {

/// Reads all that a reload needs.
tl::expected<Reread, Error> readAgain(const Arguments& arguments) {
  const auto places = located(arguments.places);
  auto config = places ? configured(arguments, *places) : tl::unexpected(places.error());
  if (!config) return tl::unexpected(config.error());
  return reread(completed(*std::move(config), *places));
}

}  // namespace

int failed(const Error& error) {
  std::cerr << logLine("tractiond", spdlog::level::err, error.message()) << "\n";
  return error.exitCode;
}

tl::expected<Config, Error> configured(const Arguments& arguments, const Places& places) {
  auto config = places.config.empty() ? tl::expected<Config, Error>() : loadConfig(places.config);
  if (config) {
    config->camera.images = arguments.images;
    config->camera.inspector = "/proc/self/exe";
    config->record = arguments.record;
  }
  return config;
}

int replayRecording(const Arguments& arguments, const Config& config, const Places& places) {
  const Log log("tractiond", config.logLevel);
  const auto done = replay(config, places, arguments.replay);
  if (!done) spdlog::error("{}", done.error().message());
  return done ? EX_OK : done.error().exitCode;
}

int serve(const Arguments& arguments, const Config& config, const Places& places, char** argv) {
  catchSignals();
  if (const auto raised = raiseDescriptorLimit(); !raised) return failed(raised.error());
  const auto log = std::make_shared<Log>("tractiond", config.logLevel);
  const auto failed = [](const Error& error) {
    spdlog::error("{}", error.message());
    return error.exitCode;
  };
  const auto again = [&] {
    spdlog::info("starts again with the gel file that was adopted");
    log->drain();
    execv("/proc/self/exe", argv);  // the same process for systemd, and nothing of the old one's state
    return failed({.exitCode = EX_OSERR, .what = "cannot start again", .remedy = "start it by hand"});
  };
  std::error_code ignored;
  const bool recordsAnew = !config.record.file.empty() && !std::filesystem::exists(config.record.file, ignored);
  std::optional<StopWhileStarting> starting([&] {
    std::error_code failure;
    const Config complete = completed(config, places);
    for (const auto* list : {&complete.publish.stream, &complete.publish.latest, &complete.controlEndpoints}) {
      for (const std::string& endpoint : *list) std::filesystem::remove(network::socketFileOf(endpoint), failure);
    }
    // The instrument may have made it, and would not be started with it again.
    if (recordsAnew && std::filesystem::is_empty(config.record.file, failure))
      std::filesystem::remove(config.record.file, failure);
    forgetStart(complete.sensor.adopted);
    spdlog::info("stopped before it ran");
    log->drain();
    std::_Exit(EX_OK);
  });
  auto instrument = Instrument::make(config, places, log);
  starting.reset();
  const auto started = instrument ? (*instrument)->start() : tl::unexpected(instrument.error());
  if (!started) {
    const int code = failed(started.error());
    if (instrument) (*instrument).reset();
    const std::filesystem::path adopted = completed(config, places).sensor.adopted;
    const bool isAbsent = code == EX_UNAVAILABLE || code == EX_TEMPFAIL;  // the camera, or its directory is in use
    if (isAbsent) forgetStart(adopted);
    // The service manager does not start it again after some codes.
    return !isAbsent && isOnTrial(adopted) ? again() : code;
  }
  ServiceHooks hooks = (*instrument)->hooks();
  hooks.reload = [&running = **instrument, arguments] {
    return [&running, read = readAgain(arguments)] { running.takeOver(read); };
  };
  run(hooks);
  const bool startsAgain = hooks.startsAgain();
  const auto stopped = (*instrument)->stop();
  if (startsAgain && stopped) {
    (*instrument).reset();  // gives camera, sockets and directories back
    return again();
  }
  return stopped ? EX_OK : failed(stopped.error());
}

}  // namespace tractiond
