#include "client/cli/calibrate.h"

#include "client/cli/json.h"
#include "client/cli/output.h"
#include "client/src/printable.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>

namespace traction::cli {

namespace {

using Kind = CalibrationStep::Kind;

constexpr double kGramForce = 9.80665e-3;  // [N]

class Guide {
 public:
  Guide(const ControlOptions& control, const CalibrateOptions& options)
      : control_(control)
      , options_(options)
      , asks_(!options.yes && isatty(STDIN_FILENO) != 0) {}

  void run() {
    control_.description();  // fails if no daemon answers, before the operator is asked to do anything
    if (wants("geometry")) geometry();
    if (wants("noise")) noise();
    if (wants("weights")) weights();
    if (wants("finish")) finish();
  }

 private:
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

  void report(const std::string& step, const CalibrationReport& report) const {
    if (options_.json) {
      std::printf("%s\n", toJson(step, report).c_str());
      flushOutput();
      return;
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
    CalibrationStep step;
    step.kind = Kind::kGeometry;
    step.anyway = options_.anyway;
    report("geometry", control_.calibrate(step));
  }

  void noise() const {
    instruct("Noise: leave the gel untouched, with the machine around it as it is in use");
    CalibrationStep step;
    step.kind = Kind::kNoise;
    if (!wants("weights")) step.seconds = options_.seconds;  // else it is the patience for the weights
    step.anyway = options_.anyway;
    report("noise", control_.calibrate(step));
  }

  void weights() const {
    CalibrationStep step;
    step.kind = Kind::kWeight;
    step.seconds = options_.seconds;
    step.first = true;
    for (const double weight : options_.weights_N) {
      char text[100];
      std::snprintf(text, sizeof text, "Weights: put %.5g gf on the gel, near its middle, and let go of it",
                    weight / kGramForce);
      instruct(text);
      step.weight_N = weight;
      report("weight", control_.calibrate(step));
      step.first = false;
    }
    step.kind = Kind::kStiffness;
    report("stiffness", control_.calibrate(step));
    say("Take the weight off.");
  }

  void finish() const {
    CalibrationStep step;
    step.kind = Kind::kFinish;
    step.name = options_.name;
    const CalibrationReport done = control_.calibrate(step);
    say("Written: " + done.path);
    report("finish", done);
  }

  Control control_;
  const CalibrateOptions& options_;
  bool asks_;
};

}  // namespace

std::optional<std::vector<double>> parseWeights(const std::string& text) {
  constexpr double kLargest_N = 1e6;  // of a gel file
  const std::map<std::string, double> newtons = {
      {"gf", kGramForce}, {"g", kGramForce}, {"kgf", 1e3 * kGramForce}, {"mN", 1e-3}, {"N", 1.0}};
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

void calibrate(const ControlOptions& control, const CalibrateOptions& options) {
  Guide(control, options).run();
}

}  // namespace traction::cli
