// Arguments in, exit code out.
#include "daemon/config_toml.h"
#include "daemon/instrument.h"
#include "daemon/service.h"

#include <CLI/CLI.hpp>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <iostream>

using namespace tractiond;

namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  stopped as asked
  64  the command line is wrong
  65  a file in the state directory is damaged or belongs to another sensor
  66  a file cannot be read
  69  no camera, or an address is in use
  70  a bug: the account of the frames does not balance
  71  the operating system refuses something
  73  a directory or file cannot be created
  75  the camera or the state directory is in use by somebody else
  77  no permission
  78  the configuration is wrong)";

int failed(const Error& error) {
  std::cerr << "tractiond: " << error.message() << "\n";
  return error.exitCode;
}

int printCameras(bool withFake) {
  for (const auto& camera : capture::listCameras(withFake)) {
    std::cout << camera.vendor << "-" << camera.serial << "  " << camera.model << "  " << camera.address << "  "
              << camera.physicalId << "  " << camera.protocol << "\n";
  }
  return EX_OK;
}

int serve(const Config& config, const Places& places) {
  blockSignals();  // before any thread
  auto logger = spdlog::stderr_logger_mt("tractiond");
  logger->set_pattern("tractiond: %v");
  logger->set_level(spdlog::level::from_str(config.logLevel));
  spdlog::set_default_logger(logger);
  auto instrument = Instrument::make(config, places);
  if (!instrument) return failed(instrument.error());
  (*instrument)->start();
  run((*instrument)->hooks());
  const auto stopped = (*instrument)->stop();
  return stopped ? EX_OK : failed(stopped.error());
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app("Surface traction fields from a camera that looks into a gel.", "tractiond");
  Places places;
  bool check = false, print = false, cameras = false;
  app.add_option("--instance", places.instance, "name of one of several daemons on a machine")->capture_default_str();
  app.add_option("--config", places.config, "configuration file; default /etc/tractiond/INSTANCE.toml if it is there");
  app.add_option("--state", places.state, "directory of the zero and of what is computed once");
  app.add_option("--runtime", places.runtime, "directory of the sockets");
  app.add_flag("--check-config", check, "check the configuration and the gel file, and exit");
  app.add_flag("--print-config", print, "print the configuration with every key, and exit");
  app.add_flag("--cameras", cameras, "list the cameras in sight, and exit");
  app.set_version_flag("--version", std::string("tractiond " TRACTIOND_VERSION));
  app.footer(kExitCodes);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& stop) {
    if (stop.get_exit_code() == 0) return app.exit(stop);  // --help, --version
    return failed({.exitCode = EX_USAGE, .what = stop.what(), .remedy = "tractiond --help"});
  }
  const auto located = tractiond::located(places);
  if (!located) return failed(located.error());
  const auto config = located->config.empty() ? tl::expected<Config, Error>() : loadConfig(located->config);
  if (!config) return failed(config.error());
  if (print) return std::cout << configText(*config), EX_OK;
  if (cameras) return printCameras(config->camera.fakeInterface);
  if (!check) return serve(*config, *located);
  const auto sensor = loadSensor(config->sensor.gelFile);
  return sensor ? EX_OK : failed(sensor.error());
} catch (const std::exception& error) {
  return failed({.exitCode = EX_OSERR, .what = error.what()});
}
