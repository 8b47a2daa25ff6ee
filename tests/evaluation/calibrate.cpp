// Calibrates a sensor that is not what its gel file says, as the daemon does: from pictures of the untouched markers,
// and from known weights, whose displacements come from elsewhere.
//
// Reads JOB/displacement.f64 (weights x markers x 3, m); writes JOB/figures, a line for each: step, name, value,
// deviation.
#include "daemon/calibrate/calibration.h"
#include "tests/evaluation/eye.h"

#include <CLI/CLI.hpp>

#include <cmath>

using namespace tractiond;
using namespace evaluation;
using calibrate::Calibration;
using Kind = CalibrationStep::Kind;

namespace {

constexpr std::int64_t kInterval_ns = 1'000'000'000 / 60;
constexpr double kLargestStep_px = 1.5;  // of a marker between frames

struct Options {
  std::filesystem::path job;
  std::string gel;      // what the daemon believes
  std::string twinGel;  // what the camera sees
  std::vector<double> weights_N;
  twin::Optics optics;
  unsigned seed = 1;
};

class Bench {
 public:
  Bench(const Options& options, const sensor::Sensor& believed, const sensor::Sensor& seen)
      : eye_(seen, options.optics, options.seed)
      , figures_(options.job / "figures")
      , calibration_(believed) {
    figures_.precision(12);
    field_.resize(believed.markerCount());
    tracker_ = trackerAtRest(believed, {}, eye_, field_, &zero_);
  }

  /// A step that needs no frames.
  void measure(const std::string& name, Kind kind) { write(name, *calibration_.begin(stepOf(kind), &zero_, {}, {})); }

  /// A step that runs while the gel is in this state.
  void watch(const std::string& name, Kind kind, const sensor::Points& displacement, double weight_N = 0.0) {
    CalibrationStep step = stepOf(kind);
    step.weight_N = weight_N;
    std::optional<calibrate::Result> result = calibration_.begin(step, &zero_, {}, {});
    for (move(displacement); !result; result = show(displacement)) {
    }
    write(name, *result);
  }

  /// To another state, in as many frames as the tracker wants.
  void move(const sensor::Points& displacement) {
    const Eigen::Matrix2Xd here = eye_.project(last_, {}), there = eye_.project(displacement, {});
    const int steps = static_cast<int>(std::ceil((there - here).colwise().norm().maxCoeff() / kLargestStep_px));
    const sensor::Points from = last_;
    for (int i = 1; i < steps; ++i) show(from + (displacement - from) * i / steps);
  }

 private:
  static CalibrationStep stepOf(Kind kind) {
    CalibrationStep step;
    step.kind = kind;
    return step;
  }

  std::optional<calibrate::Result> show(const sensor::Points& displacement) {
    now_ns_ += kInterval_ns;
    Frame frame = eye_.shoot(eye_.project(displacement, {}), 1.0);
    frame.info.times.received_ns = now_ns_;
    tracker_->track(frame, field_);
    last_ = displacement;
    return calibration_.add(field_);
  }

  void write(const std::string& step, const calibrate::Result& result) {
    if (!result) fail(step + ": " + result.error());
    for (const auto& figure : result->figures) {
      figures_ << step << " " << figure.name << " " << figure.value << " " << figure.deviation << "\n";
    }
  }

  Eye eye_;
  std::ofstream figures_;
  Calibration calibration_;
  std::unique_ptr<track::Tracker> tracker_;
  RestPose zero_;
  MarkerField field_;
  sensor::Points last_ = eye_.rest();
  std::int64_t now_ns_ = 1'000'000'000;
};

void run(const Options& options) {
  const sensor::Sensor believed = loadSensor(options.gel), seen = loadSensor(options.twinGel);
  const auto displacement = readAll<double>(options.job / "displacement.f64");
  const auto count = static_cast<std::size_t>(3 * seen.markerCount());
  if (displacement.size() != count * options.weights_N.size()) fail("displacement.f64 is not weights x markers x 3");
  Bench bench(options, believed, seen);
  const sensor::Points rest = sensor::Points::Zero(3, seen.markerCount());
  bench.measure("geometry", Kind::kGeometry);
  bench.watch("noise", Kind::kNoise, rest);
  for (std::size_t i = 0; i < options.weights_N.size(); ++i) {
    const Eigen::Map<const sensor::Points> under(displacement.data() + i * count, 3, seen.markerCount());
    bench.watch("weight", Kind::kWeight, under, options.weights_N[i]);
    bench.move(rest);
  }
  bench.measure("stiffness", Kind::kStiffness);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Calibrates a sensor that is not what its gel file says.", "evaluation_calibrate");
  app.add_option("job", options.job, "folder of the displacements and the figures")->required();
  app.add_option("--gel", options.gel, "gel file that the daemon has")->required();
  app.add_option("--twin-gel", options.twinGel, "gel file of what the camera sees")->required();
  app.add_option("--weights", options.weights_N, "N")->required()->delimiter(',');
  app.add_option("--seed", options.seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  run(options);
}
