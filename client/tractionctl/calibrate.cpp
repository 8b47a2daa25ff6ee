#include "client/cli/calibrate.h"

#include "client/tractionctl/commands.h"
#include "client/tractionctl/exit_codes.h"
#include "manual/number.h"
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
    return fail(
        EX_USAGE,
        (options.weights.empty() ? "missing weights, " : "'" + options.weights + "' is not a list of weights, ") +
            std::string("for example: --weights 100gf,200gf,500gf; the units are gf, g, kgf, mN and N"));
  }
  calibrate(control, options.steps);
  return EX_OK;
}

}  // namespace

void addCalibrate(Commands& commands) {
  const auto options = std::make_shared<CalibrateLine>();
  CLI::App& command =
      commands.add("calibrate", "Measures the camera's pose, the noise and the gel's stiffness, and writes a gel file",
                   [options](const Target& target) { return run(*options, target.control()); });
  CalibrateOptions& steps = options->steps;
  command
      .add_option("steps", steps.steps, "steps, of geometry, noise, weights, finish; without them: all, in this order")
      ->check(CLI::IsMember({"geometry", "noise", "weights", "finish"}));
  command
      .add_option("--weights", options->weights, "weights, in the order in which they are put on: 100gf,200gf,500gf")
      ->type_name("LIST");
  command
      .add_option("--seconds", steps.seconds,
                  "longest wait for each weight; without the step weights, duration of the noise step")
      ->type_name("SECONDS")
      ->check(manual::number(1e-9, 3600.0, "a time above 0 s and of at most 3600 s, as in 30"));
  command.add_option("--name", steps.name, "name of the gel; the name of the file begins with it")
      ->type_name("NAME")
      ->check([](const std::string& text) {
        return isValidName(text) ? "" : "'" + text + "' is not a name for a gel: 1 to 24 of A-Z a-z 0-9 _ -";
      });
  command.add_flag("--keep-zero", steps.keepZero,
                   "uses the zero in force for the geometry, instead of taking a new one");
  command.add_flag("--anyway", steps.anyway, "proceeds even if something seems to touch the gel");
  command.add_flag("--yes", steps.yes, "does not wait for Enter");
  command.add_flag("--json", steps.json, "prints one line of JSON per step");
}

}  // namespace traction::cli
