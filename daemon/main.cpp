// Arguments in, exit code out.
#include "base/service/log.h"
#include "base/service/service.h"
#include "daemon/arguments.h"
#include "daemon/capture/camera_list.h"
#include "daemon/capture/camera_plan.h"
#include "daemon/capture/child.h"
#include "daemon/capture/inspection.h"
#include "daemon/capture/last_will.h"
#include "daemon/config_toml.h"
#include "daemon/gel_files.h"
#include "daemon/instrument.h"
#include "daemon/replay.h"

#include <spdlog/spdlog.h>

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <new>
#include <optional>
#include <vector>

namespace {

using namespace tractiond;

std::string line(const Error& error) {
  return logLine("tractiond", spdlog::level::err, error.message());
}

int failed(const Error& error) {
  std::cerr << line(error) << "\n";
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

int listCameras(const capture::CameraOptions& options) {
  const auto sights = capture::inspectCameras(options.inspector, options.fakeInterface);
  if (sights.empty()) std::cerr << "tractiond: no camera in sight\n";
  for (const auto& [camera, obstacle, remedy, notes] : sights) {
    std::cout << camera.vendor << "-" << camera.serial << "  " << camera.model << "  " << camera.address << "  "
              << camera.physicalId << "  " << camera.protocol << "\n";
    if (!obstacle.empty()) std::cout << "  cannot be opened: " << obstacle << "; " << remedy << "\n";
    for (const std::string& note : notes) std::cout << "  " << note << "\n";
  }
  return EX_OK;
}

int plan(const std::string& file, const capture::CameraOptions& options) {
  const auto plan = capture::planCamera(file, options);
  if (!plan) return failed(plan.error());
  const auto list = [](const std::vector<std::string>& items) {
    std::string text;
    for (const std::string& item : items) text += (text.empty() ? "" : ", ") + item;
    return text.empty() ? std::string("none") : text;
  };
  const std::string format = plan->format.empty() ? "the camera's own, or else the first that it has" : plan->format;
  std::cout << plan->vendor << " " << plan->model << "\n  format    " << format << " of " << list(plan->formats)
            << "\n  rate      " << plan->rate << "\n  exposure  " << plan->exposure << "\n  gain      " << plan->gain
            << "\n  triggers  " << plan->trigger << "\n  PTP       " << plan->clock << "\n  chunks    " << plan->chunks
            << "\n  link      " << plan->link << "\n  set       " << list(plan->settings) << "\n";
  for (const std::string& note : plan->notes) std::cout << "  note      " << note << "\n";
  std::cout << "  note      the file describes a family: one model may have fewer formats, triggers and features\n";
  return EX_OK;
}

/// By a child: a description may end whoever evaluates it.
int planApart(int argc, char** argv, const std::string& file) {
  std::vector<std::string> words(argv + 1, argv + argc);
  words.emplace_back("--limited");
  const capture::ChildEnd end = capture::runChild(words, {});
  if (const std::string what = capture::misdeed(end); !what.empty())
    return failed({.exitCode = EX_DATAERR, .what = "the description " + what, .where = file});
  std::cout << end.output;
  std::cerr << end.errors;
  return end.code;
}

int checkConfig(const Config& config) {
  const auto gel = loadGel(config.sensor.gelFile);
  return gel ? EX_OK : failed(gel.error());
}

int replayed(const Arguments& arguments, const Config& config, const Places& places) {
  const auto log = startLog("tractiond", config.logLevel);
  const auto done = replay(config, places, arguments.replay);
  if (!done) log->write(line(done.error()));
  log->drain();
  return done ? EX_OK : done.error().exitCode;
}

/// All of what is new in the configuration, or nothing.
void reload(Instrument& instrument, const Arguments& arguments) {
  const auto places = located(arguments.places);
  auto config = places ? configured(arguments, *places) : tl::unexpected(places.error());
  const auto news = config ? instrument.reload(completed(*std::move(config), *places))
                           : tl::expected<std::vector<std::string>, Error>(tl::unexpected(config.error()));
  if (!news)
    spdlog::error("the configuration stays as it was: {}", news.error().message());
  else if (news->empty())
    spdlog::info("nothing in the configuration has changed");
  else
    for (const std::string& one : *news) spdlog::info("new in the configuration: {}", one);
}

int serve(const Arguments& arguments, const Config& config, const Places& places) {
  // Before there are threads. Pictures from a file have no camera.
  if (arguments.images.empty()) capture::startExecutor();  // the instrument warns of what fails
  catchSignals();
  if (const auto raised = raiseDescriptorLimit(); !raised) return failed(raised.error());
  const auto log = startLog("tractiond", config.logLevel);
  const auto failed = [&](const Error& error) {
    log->write(line(error));
    return error.exitCode;
  };
  std::optional<StopWhileStarting> starting([&] {
    std::error_code ignored;
    for (const auto& file : socketFiles(completed(config, places))) std::filesystem::remove(file, ignored);
    log->write(logLine("tractiond", spdlog::level::info, "stopped before it ran"));
    log->drain();
    std::_Exit(EX_OK);
  });
  auto instrument = Instrument::make(config, places, [log] { return log->lost(); });
  starting.reset();
  if (!instrument) return failed(instrument.error());
  (*instrument)->start();
  ServiceHooks hooks = (*instrument)->hooks();
  hooks.reload = [&] { reload(**instrument, arguments); };
  run(hooks);
  const auto stopped = (*instrument)->stop();
  return stopped ? EX_OK : failed(stopped.error());
}

}  // namespace

int main(int argc, char** argv) try {
  if (const auto enough = checkAddressSpace(); !enough) std::_Exit(failed(enough.error()));
  const auto arguments = parseArguments(argc, argv);
  if (!arguments) return arguments.error();
  if (!arguments->inspected.empty()) return capture::printInspection(arguments->inspected);
  if (arguments->limited) capture::limitChild();
  const auto places = located(arguments->places);
  if (!places) return failed(places.error());
  const auto config = configured(*arguments, *places);
  if (!config) return failed(config.error());
  if (arguments->printConfig) return std::cout << configText(*config), EX_OK;
  if (!arguments->description.empty()) {
    return arguments->limited ? plan(arguments->description, config->camera)
                              : planApart(argc, argv, arguments->description);
  }
  if (arguments->listCameras) return listCameras(config->camera);
  if (!arguments->replay.file.empty() && !arguments->checkConfig) return replayed(*arguments, *config, *places);
  return arguments->checkConfig ? checkConfig(*config) : serve(*arguments, *config, *places);
} catch (const std::bad_alloc&) {
  return failed({.exitCode = EX_OSERR, .what = "there is no memory left", .remedy = "see MemoryMax= of the service"});
} catch (const std::exception& error) {
  return failed({.exitCode = EX_OSERR, .what = error.what()});
}
