// Calibrates a sensor that is not what its gel file says, as the daemon does: from pictures of the untouched markers,
// and from known weights, whose displacements come from elsewhere.
//
// Reads JOB/displacement.f64 (weights x markers x 3, m); writes JOB/figures, a line for each: step, name, value,
// deviation. With --creep, reads JOB/amount.f64 and JOB/time.f64 instead of weights: how much of displacement.f64 (1 x
// markers x 3) there is at which times [s], while a load is put on, stays and is taken away; writes a gel file.
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
  double creep_s = 0.0;    // for which the load stays; 0: no creep
  double given_px = -1.0;  // no pictures: displacements with this noise
  twin::Optics optics;
  unsigned seed = 1;
};

class Bench {
 public:
  Bench(const Options& options, const sensor::Sensor& believed, const sensor::Sensor& seen)
      : options_(options)
      , eye_(seen, options.optics, options.seed)
      , figures_(options.job / "figures")
      , calibration_(believed)
      , generator_(options.seed) {
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

  /// A load that is there in these amounts at these times [s] creeps, and the gel recovers.
  void creep(const std::vector<double>& amounts, const std::vector<double>& times_s,
             const sensor::Points& displacement) {
    std::optional<calibrate::Result> result;
    CalibrationStep step = stepOf(Kind::kCreep);
    step.seconds = options_.creep_s;
    calibration_.begin(step, &zero_, {}, {});
    const std::int64_t begin_ns = now_ns_ + kInterval_ns;
    for (std::size_t i = 0; i < amounts.size(); ++i) {
      now_ns_ = begin_ns + std::llround(1e9 * times_s[i]) - kInterval_ns;
      if (!(result = show(amounts[i] * displacement))) continue;
      write(step.kind == Kind::kCreep ? "creep" : "recovery", *result);
      if (step.kind == Kind::kRecovery) break;
      step = stepOf(Kind::kRecovery);
      calibration_.begin(step, &zero_, {}, {});
    }
    if (!result) fail("the load did not stay and recover for long enough");
    write("finish", *calibration_.begin(stepOf(Kind::kFinish), &zero_, "Camera", options_.job));
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
    if (options_.given_px >= 0.0) {
      give(displacement);
    } else {
      Frame frame = eye_.shoot(eye_.project(displacement, {}), 1.0);
      frame.info.times.received_ns = now_ns_;
      tracker_->track(frame, field_);
    }
    last_ = displacement;
    return calibration_.add(field_);
  }

  /// What a tracker with this noise says.
  void give(const sensor::Points& displacement) {
    const Eigen::Matrix2Xd rest = eye_.project(eye_.rest(), {});
    const Eigen::Matrix2Xf moved = (eye_.project(displacement, {}) - rest).cast<float>();
    std::normal_distribution<float> normal(0.0F, static_cast<float>(options_.given_px));
    std::ranges::transform(moved.reshaped(), field_.displacement_px.begin(),
                           [&](float each) { return each + normal(generator_); });
    std::ranges::fill(field_.valid, std::uint8_t{1});
    field_.flags = 0;
    field_.info.times.received_ns = field_.info.times.captured_ns = now_ns_;
  }

  void write(const std::string& step, const calibrate::Result& result) {
    if (!result) fail(step + ": " + result.error());
    for (const auto& figure : result->figures) {
      figures_ << step << " " << figure.name << " " << figure.value << " " << figure.deviation << "\n";
    }
  }

  const Options& options_;
  Eye eye_;
  std::ofstream figures_;
  Calibration calibration_;
  std::unique_ptr<track::Tracker> tracker_;
  RestPose zero_;
  MarkerField field_;
  sensor::Points last_ = eye_.rest();
  std::int64_t now_ns_ = 1'000'000'000;
  std::mt19937 generator_;
};

void run(const Options& options) {
  const sensor::Sensor believed = loadSensor(options.gel), seen = loadSensor(options.twinGel);
  const auto displacement = readAll<double>(options.job / "displacement.f64");
  const auto count = static_cast<std::size_t>(3 * seen.markerCount());
  if (options.creep_s > 0.0) {
    if (displacement.size() != count) fail("displacement.f64 is not 1 x markers x 3");
    const auto amounts = readAll<double>(options.job / "amount.f64"),
               times_s = readAll<double>(options.job / "time.f64");
    if (amounts.size() != times_s.size()) fail("amount.f64 and time.f64 are not of one length");
    Bench(options, believed, seen)
        .creep(amounts, times_s, Eigen::Map<const sensor::Points>(displacement.data(), 3, seen.markerCount()));
    return;
  }
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
  app.add_option("--weights", options.weights_N, "N")->delimiter(',');
  app.add_option("--creep", options.creep_s, "s for which a load stays");
  app.add_option("--given", options.given_px, "no pictures: displacements with this noise [px]");
  app.add_option("--seed", options.seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  run(options);
}
