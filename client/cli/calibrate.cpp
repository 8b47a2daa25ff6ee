// Guides an operator, or a script, through the calibration of a sensor.
#include "base/printable.h"
#include "client/cli/commands.h"
#include "client/cli/exit_codes.h"
#include "client/show/json.h"
#include "client/show/output.h"
#include "client/show/page.h"
#include "manual/number.h"
#include "proto/traction/v1/endpoints.h"
#include "traction/control.h"

#include <sysexits.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace traction::client {

namespace {

struct CalibrateOptions {
  std::vector<std::string> steps;  ///< of geometry, noise, creep, weights, finish; empty: all but creep
  std::vector<double> weights_N;   ///< in the order in which they are put on [N]; not empty if the step weights runs
  /// Of each weight, as CalibrationStep::direction; or one for all of them; or none: the daemon's default.
  std::vector<std::array<double, 3>> directions;
  /// Longest wait for each weight; duration of the noise step, if the step weights does not run. 0: the daemon's
  /// default
  double seconds = 0.0;
  double hold_s = 60.0;   ///< for which a load stays in the step creep
  std::string name;       ///< name of the gel, for the file: 1 to 24 of A-Z a-z 0-9 _ -; empty: gel
  bool keepZero = false;  ///< true: geometry uses the zero in force; false: takes a new one
  bool anyway = false;    ///< true: proceeds even if something seems to touch the gel
  bool yes = false;       ///< true: does not wait for Enter
  bool json = false;
};

/// Runs the steps, always in the order geometry, noise, creep, weights, finish, and prints instructions and reports on
/// standard output, with `json` only the reports, one line of JSON each. The step weights reads each weight, and then
/// estimates the stiffness. Waits for Enter after each instruction if standard input is a terminal and `options.yes` is
/// false; the instruction is then printed with `json` as well, on standard error. Blocks until they are done; a step
/// that fails ends it, and keeps what the steps before it did.
/// \throws Error as Control::calibrate() and Control::zero() if a step fails, kNoAnswer before the first instruction if
/// no daemon answers; OutputError if standard output cannot be written
class Guide {
 public:
  Guide(const ControlOptions& control, const CalibrateOptions& options)
      : control_(control)
      , options_(options)
      , asks_(!options.yes && isatty(STDIN_FILENO) != 0) {}

  void run() {
    // Fails if no daemon answers, before the operator is asked to do anything.
    isBody_ = control_.description().body.has_value();
    if (wants("geometry")) geometry();
    if (wants("noise")) noise();
    if (!options_.steps.empty() && wants("creep")) creep();
    if (wants("weights")) weights();
    if (wants("finish")) measure("finish", {.kind = Kind::kFinish, .name = options_.name});
  }

 private:
  using Kind = CalibrationStep::Kind;

  bool wants(const char* step) const {
    const auto& steps = options_.steps;
    return steps.empty() || std::find(steps.begin(), steps.end(), step) != steps.end();
  }

  void say(const std::string& sentence) const {
    if (options_.json) return;
    std::printf("%s\n", printable(sentence).c_str());
    flushOutput();
  }

  void instruct(const std::string& sentence) const {
    say(sentence + (asks_ ? "; then press Enter." : "."));
    if (!asks_) return;
    if (options_.json) std::fprintf(stderr, "%s; then press Enter.\n", sentence.c_str());
    for (int c = std::getchar(); c != '\n' && c != EOF; c = std::getchar()) {
    }
  }

  /// Tells what is to be done while the next step runs.
  void announce(const std::string& sentence) const {
    say(sentence);
    if (options_.json && asks_) std::fprintf(stderr, "%s\n", sentence.c_str());
  }

  /// Carries out a step, and prints what it has measured.
  void measure(const char* name, const CalibrationStep& step) const {
    const CalibrationReport report = control_.calibrate(step);
    if (step.kind == Kind::kFinish) say("Written: " + report.path);
    if (options_.json) {
      std::printf("%s\n", toJson(name, report).c_str());
      return flushOutput();
    }
    for (const CalibrationReport::Figure& figure : report.figures) {
      std::printf("  %-32s %.7g", printable(figure.name).c_str(), figure.value);
      if (figure.deviation > 0.0) std::printf(" +- %.2g", figure.deviation);
      std::printf("\n");
    }
    for (const std::string& remark : report.remarks) std::printf("  note: %s\n", printable(remark).c_str());
    flushOutput();
  }

  void geometry() const {
    if (!options_.keepZero) {
      instruct("Geometry: take everything off the gel and keep the camera still");
      const ZeroResult zero = control_.zero({.anyway = options_.anyway});
      say("  zero taken: " + std::to_string(zero.markersPresent) + " of " + std::to_string(zero.markersExpected) +
          " markers");
    }
    measure("geometry", {.kind = Kind::kGeometry, .anyway = options_.anyway});
  }

  void noise() const {
    instruct("Noise: leave the gel untouched, with the machine around it as it is in use");
    const double seconds = wants("weights") ? 0.0 : options_.seconds;  // else it is the patience for the weights
    measure("noise", {.kind = Kind::kNoise, .seconds = seconds, .anyway = options_.anyway});
  }

  void creep() const {
    instruct("Creep: leave the gel untouched until it has recovered from earlier loads");
    char time[40];
    std::snprintf(time, sizeof time, "%g s", options_.hold_s);
    announce(std::string("  wait for two seconds, put a weight on the gel quickly, and let it stand for ") + time);
    measure("creep", {.kind = Kind::kCreep, .seconds = options_.hold_s});
    announce(std::string("  take it away now, quickly, and leave the gel untouched for ") + time);
    measure("recovery", {.kind = Kind::kRecovery, .seconds = options_.hold_s});
  }

  void weights() const {
    CalibrationStep step{.kind = Kind::kWeight, .seconds = options_.seconds, .first = true};
    const char* const where = isBody_ ? "" : ", near its middle,";
    for (std::size_t i = 0; i < options_.weights_N.size(); ++i) {
      step.weight_N = options_.weights_N[i];
      if (!options_.directions.empty()) {
        step.direction = options_.directions[std::min(i, options_.directions.size() - 1)];
      }
      char text[100];
      std::snprintf(text, sizeof text, "Weights: put %.5g gf on the gel%s and let go of it",
                    step.weight_N / kGramForce_N, where);
      instruct(text);
      measure("weight", step);
      step.first = false;
    }
    measure("stiffness", {.kind = Kind::kStiffness});
    say("Take the weight off.");
  }

  Control control_;
  const CalibrateOptions& options_;
  bool asks_;
  bool isBody_ = false;  ///< its weights may have places of their own
};

/// Parses a list of weights and returns newtons: "100gf,200gf,5N". Units: gf (or g, as a mass), kgf, mN and N. Returns
/// nothing if it is not such a list, is empty, or has a weight that is not above 0 and at most 10^6 N.
std::optional<std::vector<double>> parseWeights(const std::string& text) {
  constexpr double kLargest_N = 1e6;  // of a gel file
  const std::map<std::string, double> newtons = {
      {"gf", kGramForce_N}, {"g", kGramForce_N}, {"kgf", 1e3 * kGramForce_N}, {"mN", 1e-3}, {"N", 1.0}};
  std::vector<double> weights;
  if (text.empty() || text.back() == ',') return std::nullopt;
  std::istringstream list(text);
  for (std::string one; std::getline(list, one, ',');) {
    std::istringstream parts(one);
    double value = 0.0;
    std::string unit, more;
    if (!(parts >> value >> unit) || parts >> more) return std::nullopt;
    const auto found = newtons.find(unit);
    if (found == newtons.end()) return std::nullopt;
    const double weight_N = value * found->second;
    if (!(weight_N > 0.0 && weight_N <= kLargest_N)) return std::nullopt;
    weights.push_back(weight_N);
  }
  if (weights.empty()) return std::nullopt;
  return weights;
}

/// Parses a direction: "0,0.5,1". Returns nothing if it is none, or has no length.
std::optional<std::array<double, 3>> parseDirection(const std::string& text) {
  std::istringstream list(text);
  std::array<double, 3> direction{};
  char comma = ',';
  for (std::size_t i = 0; i < direction.size(); ++i) {
    if ((i > 0 && !(list >> comma)) || comma != ',' || !(list >> direction[i])) return std::nullopt;
  }
  const bool isLong = std::hypot(direction[0], direction[1], direction[2]) > 0.0;
  if (!isLong || list.peek() != std::istringstream::traits_type::eof()) return std::nullopt;
  return direction;
}

struct CalibrateLine {
  CalibrateOptions steps;
  std::string weights;
  std::vector<std::string> directions;
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
  for (const std::string& text : options.directions) {
    const auto direction = parseDirection(text);
    if (!direction) return fail(EX_USAGE, "'" + text + "' is not a direction, for example: --direction 0,0.5,1");
    options.steps.directions.push_back(*direction);
  }
  const std::size_t given = options.directions.size();
  if (given > 1 && given != options.steps.weights_N.size()) {
    return fail(EX_USAGE, "--direction is stated once, or once for each of --weights");
  }
  Guide(control, options.steps).run();
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
      .add_option("steps", steps.steps,
                  "steps, of geometry, noise, creep, weights, finish; without them: all but creep, in this order")
      ->check(CLI::IsMember({"geometry", "noise", "creep", "weights", "finish"}));
  command
      .add_option("--weights", options->weights, "weights, in the order in which they are put on: 100gf,200gf,500gf")
      ->type_name("LIST");
  command
      .add_option(
          "--direction", options->directions,
          "direction x,y,z in the gel's frame along which the weights are known, such as that in which a force "
          "gauge measures; again for each of the weights, or once for all; without: z for a block, and the whole "
          "force of another body")
      ->type_name("X,Y,Z")
      ->allow_extra_args(false);
  command
      .add_option("--seconds", steps.seconds,
                  "longest wait for each weight; without the step weights, duration of the noise step")
      ->type_name("SECONDS")
      ->check(manual::number(1e-9, 3600.0, "a time above 0 s and of at most 3600 s, as in 30"));
  command
      .add_option("--hold", steps.hold_s,
                  "time for which a weight stays in the step creep, and the gel recovers; by default 60")
      ->type_name("SECONDS")
      ->check(manual::number(10.0, 3600.0, "a time of 10 to 3600 s, as in 60"));
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

}  // namespace traction::client
