#include "client/cli/calibrate.h"

#include "client/tractionctl/commands.h"
#include "client/tractionctl/exit_codes.h"
#include "client/tractionctl/parsing.h"
#include "proto/traction/v1/endpoints.h"

#include <sysexits.h>

#include <algorithm>
#include <memory>

namespace traction::cli {

namespace {

struct CalibrateLine {
  CalibrateOptions steps;
  std::string weights;
};

int run(CalibrateLine options, const ControlOptions& control) {
  const std::vector<std::string>& steps = options.steps.steps;
  if (const auto parsed = parseWeights(options.weights)) {
    options.steps.weights_N = *parsed;
  } else if (!options.weights.empty() || steps.empty() || std::ranges::find(steps, "weights") != steps.end()) {
    return fail(EX_USAGE,
                (options.weights.empty() ? "which weights? " : "'" + options.weights + "' is no list of weights; ") +
                    std::string("--weights 100gf,200gf,500gf, say; units are gf, g, kgf, mN and N"));
  }
  calibrate(control, options.steps);
  return EX_OK;
}

}  // namespace

void addCalibrate(Commands& commands) {
  const auto options = std::make_shared<CalibrateLine>();
  CLI::App& command =
      commands.add("calibrate", "Measures the camera's place, the noise and the gel's stiffness, and writes a gel file",
                   [options](const Target& target) { return run(*options, target.control()); });
  CalibrateOptions& steps = options->steps;
  command.add_option("steps", steps.steps, "of geometry, noise, weights, finish; without: all, in this order")
      ->check(CLI::IsMember({"geometry", "noise", "weights", "finish"}));
  command.add_option("--weights", options->weights, "to be put on one after another: 100gf,200gf,500gf")
      ->type_name("LIST");
  command.add_option("--seconds", steps.seconds, "to look for the noise, and to wait for each weight")
      ->type_name("SECONDS")
      ->check(number(1e-9, "a time above 0 s, as in 30"));
  command.add_option("--name", steps.name, "of the gel: the file's name begins with it")
      ->type_name("NAME")
      ->check([](const std::string& text) {
        return isValidName(text) ? "" : "'" + text + "' is no name for a gel: 1 to 24 of A-Z a-z 0-9 _ - are";
      });
  command.add_flag("--keep-zero", steps.keepZero, "geometry from the zero in force, instead of a new one");
  command.add_flag("--anyway", steps.anyway, "also if something seems to touch the gel");
  command.add_flag("--yes", steps.yes, "do not wait for Enter");
  command.add_flag("--json", steps.json, "one line of JSON a step");
}

}  // namespace traction::cli
