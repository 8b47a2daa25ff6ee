#include "twin/options.h"

#include "base/directory.h"
#include "manual/number.h"
#include "manual/parse.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <iostream>

namespace twin {

namespace {

constexpr const char* kExitCodes = R"(Exit codes (sysexits.h):
   0  ended as asked
  64  the command line is wrong
  65  the file of raw pictures is not of the scenario's size and format
  66  a file cannot be read
  69  an address is in use, or not this machine's
  73  a file cannot be created
  74  a file cannot be written
  78  the scenario is wrong)";

/// Returns share/tractiond/scenarios beside the program's bin directory, in the build as in an installation.
std::filesystem::path scenarioDirectory() {
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path() / "share" / "tractiond" / "scenarios";
}

std::string shippedNames() {
  std::vector<std::string> names;
  for (const std::filesystem::path& path : tractiond::entriesOf(scenarioDirectory())) {
    if (path.extension() == ".toml") names.push_back(path.stem());
  }
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// Adds the options, which fill `options` and the name of a pixel format. Both must outlive the command line.
void addOptions(CLI::App& app, Options& options, std::string& format) {
  app.add_option("SCENARIO", options.scenario, "TOML file, or name of a shipped scenario")->type_name("");
  auto* const address = app.add_option("--address", options.address, "Local IPv4 address to serve on; the port is 3956")
                            ->type_name("ADDRESS")
                            ->capture_default_str();
  app.add_option("--second-address", options.secondAddress, "With a gripper: address of the second finger's camera")
      ->type_name("ADDRESS")
      ->capture_default_str();
  app.add_option("--commands", options.commands,
                 "With a gripper: ZeroMQ endpoint (PULL) for its commands, \"OPENING HEIGHT\" in metres")
      ->type_name("ENDPOINT")
      ->capture_default_str();
  app.add_flag("--lockstep", options.lockstep,
               "With a gripper: from the first command on, each pair of pictures waits for a command");
  app.add_option("--gel", options.gel, "Gel file, in place of the scenario's gel, markers and camera")
      ->type_name("FILE");
  app.add_option("--format", format, "Pixel format, in place of the scenario's")
      ->check([](const std::string& name) { return formatByName(name) ? "" : "it is one of " + formatNames(); },
              "{" + formatNames() + "}");
  app.add_option("--rate", options.rate_hz, "Frames per second, in place of the scenario's")
      ->check(manual::number(1.0, 1000.0));
  app.add_option("--seed", options.seed, "Of the noise")->capture_default_str();
  app.add_option("--truth", options.truth, "File for what is true in each frame, JSON lines")->type_name("FILE");
  app.add_flag("--truth-markers", options.truthMarkers, "With the displacement of every marker [px]");
  auto* const lostRatio = app.add_option("--lost-ratio", options.lostRatio, "Share of the stream's packets to lose");
  lostRatio->check(manual::number(0.0, 1.0));
  app.add_option("--seconds", options.seconds,
                 "End after this time (0: on SIGINT or SIGTERM); with --images the scenario's")
      ->check(manual::number(0.0, 1e9));
  app.add_option("--cache", options.cache, "Directory in which to keep the gel's mechanics from start to start")
      ->type_name("DIR");
  app.add_option("--serve", options.served,
                 "File of raw pictures of the scenario's size and format, to serve in a loop in place of drawing")
      ->type_name("FILE");
  app.add_option(
         "--images", options.images,
         "File or pipe (-: standard output) to write raw pictures to, as tractiond --images reads them, in place of "
         "serving them; as fast as they are read")
      ->type_name("FILE")
      ->excludes(address)
      ->excludes(lostRatio);
}

}  // namespace

tl::expected<Options, int> parseCommandLine(int argc, char** argv) {
  Options options;
  std::string format;
  CLI::App app("A gel and a GigE Vision camera that do not exist: serves a scenario's pictures.", "traction-twin");
  app.footer([] { return "Shipped scenarios: " + shippedNames() + "\n\n" + kExitCodes; });
  app.set_version_flag("--version", "traction-twin " TRACTION_VERSION);
  addOptions(app, options, format);
  if (const auto parsed = manual::parse(app, argc, argv); !parsed) return tl::unexpected(parsed.error());
  if (options.scenario.empty()) {  // checked here, so that an unknown word is reported first
    std::cerr << "traction-twin: a scenario, such as " << shippedNames() << ", is required; see traction-twin --help\n";
    return tl::unexpected(EX_USAGE);
  }
  options.format = formatByName(format);
  return options;
}

tl::expected<std::filesystem::path, tractiond::Error> findScenario(const std::string& scenario) {
  const bool isName =
      std::all_of(scenario.begin(), scenario.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
  if (!isName) return scenario;
  std::filesystem::path shipped = scenarioDirectory() / (scenario + ".toml");
  if (std::filesystem::exists(shipped)) return shipped;
  return tl::unexpected(
      tractiond::Error{EX_NOINPUT, "no scenario is called '" + scenario + "'; shipped are " + shippedNames()});
}

}  // namespace twin
