// The chain from camera picture to forces, one frame after another in one thread, on displacements from elsewhere:
// each frame is projected and drawn as the twin draws it, and tracked and solved as the daemon does. Or, without
// pictures, the displacements are given to the solver with noise of a known size.
//
// Reads from JOB: displacement.f64 (frames x markers x 3, m); and, where they are there, missing.u8 (frames x markers),
// picture.f64 (frames x 5: how the picture strays: shift along u, v [px], scale - 1, roll [rad], brightness),
// scatter.f64 (markers x 3, m: where the gel's own markers sit beside the gel file's places), highlight.f64 (frames x
// 4: a highlight's centre u, v [px], radius [px] and strength [levels]), time.f64 (frames: when each is taken [s], for
// gels that creep and heat), amount.f64 (frames x patterns: displacement.f64 are then patterns x markers x 3, of which
// each frame shows so much) and options. Writes each figure of a frame to
// JOB/NAME.f64 (frames x columns), and "columns" with a line for each; with --brief nothing of single markers and
// nodes. With --cold, the caches are emptied before each frame that is judged: what was drawn before it leaves them as
// full as it happens to. With --as-daemon, most frames are answered by
// an earlier frame's model, as in the daemon, which learns in no time. With --answer, also answers each frame by the
// model of the frame before: whether it could be is in "answered", the figures are in answer_NAME.f64.
#include "base/clock.h"
#include "daemon/app/config.h"
#include "daemon/calibrate/zero_tracking.h"
#include "daemon/solve/make_solver.h"
#include "daemon/track/creep_memory.h"
#include "tests/evaluation/eye.h"
#include "touch/partial_slip.h"

#include <CLI/CLI.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <ranges>
#include <vector>

using namespace tractiond;
using namespace evaluation;

namespace {

struct Options {
  std::filesystem::path job, state;
  std::string gel;      // what the daemon believes; empty: the paper's
  std::string twinGel;  // what the camera sees; empty: the same
  std::string config;   // [track] and [solve]
  twin::Optics optics;
  std::string format = "RGB8";
  double given_px = -1.0;  // no pictures: displacements with this noise
  double extra_px = 0.0;   // noise added to what the tracker says
  bool sameNoise = false;  // in every frame the same given noise
  bool litAtZero = false;  // the highlight was there when the zero was taken
  int zeroEvery = 0;       // frames after which a new zero is taken; 0: one zero for all
  double largestStep_px = 1.5;
  unsigned seed = 1;
  bool answer = false;    // answer each frame by the model of the frame before, too
  bool brief = false;     // write nothing of single markers and nodes
  bool cold = false;      // empty the caches before each frame
  bool asDaemon = false;  // solve in full only what an earlier model cannot answer, and to learn when it grows old
};

/// Columns of numbers, a file for each name, a row a frame.
class Columns {
 public:
  /// \param prefix of all names
  /// \param most numbers of a row that is written
  explicit Columns(std::filesystem::path folder, std::string prefix, std::size_t most)
      : folder_(std::move(folder))
      , prefix_(std::move(prefix))
      , most_(most) {}

  template <std::ranges::range Values>
  void add(const std::string& name, const Values& values) {
    if (std::size(values) > most_) return;
    auto& file = files_[name];
    if (!file.is_open()) {
      file.open(folder_ / (prefix_ + name + ".f64"), std::ios::binary);
      std::ofstream(folder_ / "columns", std::ios::app) << prefix_ + name << " " << std::size(values) << "\n";
    }
    for (const auto value : values) {
      const double number = static_cast<double>(value);
      file.write(reinterpret_cast<const char*>(&number), sizeof number);
    }
  }
  void add(const std::string& name, double value) { add(name, std::array{value}); }

 private:
  std::filesystem::path folder_;
  std::string prefix_;
  std::size_t most_;
  std::map<std::string, std::ofstream> files_;
};

/// What touch reads of a contact besides its place.
touch::Observation observationOf(const Contact& contact) {
  touch::Observation seen{.force_N = contact.force_N,
                          .forceDeviation_N = contact.forceDeviation_N,
                          .moment_Nm = contact.moment_Nm,
                          .halfAxes_m = contact.halfAxes_m,
                          .halfAxesDeviation_m = contact.halfAxesDeviation_m,
                          .orientation_rad = contact.orientation_rad,
                          .orientationDeviation_rad = contact.orientationDeviation_rad,
                          .shearSpreadRatio = contact.spreadRatio,
                          .shearSpreadRatioDeviation = contact.spreadRatioDeviation};
  seen.momentCovariance_N2m2.noise[8] = contact.noise[35];
  return seen;
}

/// Friction of a contact, whatever touches: its low end while it is at rest; estimate, low and high end if it slides
/// along its load.
std::array<double, 4> frictionOf(touch::Observation seen) {
  seen.shearSpreadRatioDeviation = 0.0;
  const touch::Slip rests = touch::PartialSlip().see(seen, 1, {}).value_or(touch::Slip{});
  touch::PartialSlip sliding;
  touch::Motion moved{.turn_rad = std::copysign(0.2, seen.moment_Nm[2]), .turnDeviation_rad = 0.01};
  for (std::size_t i = 0; i < 2; ++i) moved.way_m[i] = 1e-3 * seen.force_N[i];
  sliding.see(seen, 1, moved);
  const touch::Slip slides = sliding.see(seen, 2, moved).value_or(touch::Slip{});
  if (slides.model != touch::SlipModel::kSliding) return {rests.friction.low};
  return {rests.friction.low, slides.friction.estimate, slides.friction.low, slides.friction.high};
}

/// Returns the numbers of several ranges, one after another.
template <std::ranges::range... Ranges>
std::vector<double> joined(const Ranges&... ranges) {
  std::vector<double> numbers;
  (numbers.insert(numbers.end(), std::begin(ranges), std::end(ranges)), ...);
  return numbers;
}

/// Adds `width` numbers of each contact, and zeros for those that there are not.
template <typename Of>
void addOfEach(const TractionField& field, const std::string& name, std::size_t width, Of of, Columns& out) {
  std::vector<double> numbers;
  for (int i = 0; i < field.contactCount; ++i)
    numbers = joined(numbers, of(field.contacts[static_cast<std::size_t>(i)]));
  numbers.resize(kMaxContacts * width);
  out.add(name, numbers);
}

/// All that is published of a frame. New figures: a line each.
void write(const TractionField& field, Columns& out) {
  out.add("valid", field.valid);
  out.add("flags", field.flags);
  out.add("method", static_cast<double>(field.method));
  out.add("resultant_N", field.resultant_N);
  out.add("moment_Nm", field.moment_Nm);
  out.add("noise_covariance", field.noise);
  out.add("systematic_covariance", field.systematic);
  out.add("force_N", field.force_N);
  out.add("deviation_N", field.deviation_N);
  out.add("marker_px", field.markers.displacement_px);
  out.add("marker_variance_px2", field.markers.variance_px2);
  out.add("marker_valid", field.markers.valid);
  out.add("contact_count", field.contactCount);
  std::array<double, 10> slip{};
  std::array<double, 4> friction{};
  if (field.contactCount > 0) {
    const Contact& contact = field.contacts[0];
    const touch::Observation seen = observationOf(contact);
    friction = frictionOf(seen);
    const touch::Slip found = touch::PartialSlip().see(seen, 1, {}).value_or(touch::Slip{});
    slip = {contact.spreadRatio,   contact.spreadRatioDeviation, double(found.model == touch::SlipModel::kBall),
            found.incipient,       found.stickRatio.estimate,    found.stickRatio.low,
            found.stickRatio.high, found.friction.estimate,      found.friction.low,
            found.friction.high};
  }
  out.add("slip", slip);  // of the strongest contact: spread ratio, deviation; known, incipient, stick ratio, friction
  out.add("friction", friction);
  const auto addContacts = [&](const std::string& name, std::size_t width, auto of) {
    addOfEach(field, name, width, of, out);
  };
  // Of each: position 2, deviation 2, force 3, deviation 3, area, deviation.
  addContacts("contacts", 12, [](const Contact& of) {
    return joined(of.position_m, of.positionDeviation_m, of.force_N, of.forceDeviation_N,
                  std::array{of.area_m2, of.areaDeviation_m2});
  });
  // Of each: spread ratio, deviation, torque, variance, half axes 2, deviation 2, orientation, deviation.
  addContacts("shapes", 10, [](const Contact& of) {
    return joined(std::array{of.spreadRatio, of.spreadRatioDeviation, of.moment_Nm[2], of.noise[35]}, of.halfAxes_m,
                  of.halfAxesDeviation_m, std::array{of.orientation_rad, of.orientationDeviation_rad});
  });
  // Of each: that of Hertz's pressure, deviation.
  addContacts("radii", 2, [](const Contact& of) {
    return joined(std::array{of.hertzRadius_m, of.hertzRadiusDeviation_m});
  });
  // Of each: moment 3, noise 36, systematic 36.
  addContacts("contact_wrenches", 75, [](const Contact& of) { return joined(of.moment_Nm, of.noise, of.systematic); });
}

/// The job's frames.
struct Job {
  Job(const Options& options, int markerCount)
      : markers(markerCount)
      , displacement(readAll<double>(options.job / "displacement.f64"))
      , missing(readAll<std::uint8_t>(options.job / "missing.u8"))
      , stray(readAll<Stray>(options.job / "picture.f64"))
      , scatter(readAll<double>(options.job / "scatter.f64"))
      , highlight(readAll<std::array<double, 4>>(options.job / "highlight.f64"))
      , time_s(readAll<double>(options.job / "time.f64"))
      , amount(readAll<double>(options.job / "amount.f64")) {
    const std::size_t count = static_cast<std::size_t>(markerCount);
    patterns = displacement.size() / (3 * count);
    if (patterns == 0 || displacement.size() != 3 * count * patterns)
      fail("displacement.f64 is not frames or patterns x markers x 3");
    frames = amount.empty() ? patterns : amount.size() / patterns;
    if (!amount.empty() && amount.size() != frames * patterns) fail("amount.f64 is not frames x patterns");
    if (!missing.empty() && missing.size() != count * frames) fail("missing.u8 is not frames x markers");
    if (!stray.empty() && stray.size() != frames) fail("picture.f64 is not frames x 5");
    if (!scatter.empty() && scatter.size() != 3 * count) fail("scatter.f64 is not markers x 3");
    if (!time_s.empty() && time_s.size() != frames) fail("time.f64 is not frames");
    if (!highlight.empty() && highlight.size() != frames) fail("highlight.f64 is not frames x 4");
  }

  sensor::Points at(std::size_t frame) const {
    const std::size_t size = 3 * static_cast<std::size_t>(markers);
    const auto pattern = [&](std::size_t i) {
      return Eigen::Map<const sensor::Points>(displacement.data() + i * size, 3, markers);
    };
    if (amount.empty()) return pattern(frame);
    sensor::Points sum = sensor::Points::Zero(3, markers);
    for (std::size_t i = 0; i < patterns; ++i) {
      if (const double share = amount[frame * patterns + i]; share != 0.0) sum += share * pattern(i);
    }
    return sum;
  }
  Stray strayAt(std::size_t frame) const { return stray.empty() ? Stray{} : stray[frame]; }
  std::array<double, 4> highlightAt(std::size_t frame) const {
    return highlight.empty() ? std::array<double, 4>{} : highlight[frame];
  }
  bool isMissing(std::size_t frame, Eigen::Index marker) const {
    return !missing.empty() && missing[frame * static_cast<std::size_t>(markers) + static_cast<std::size_t>(marker)];
  }

  int markers;
  std::size_t frames = 0, patterns = 0;
  std::vector<double> displacement;
  std::vector<std::uint8_t> missing;
  std::vector<Stray> stray;
  std::vector<double> scatter;
  std::vector<std::array<double, 4>> highlight;
  std::vector<double> time_s, amount;
};

void addNoise(double sigma_px, std::mt19937_64& generator, MarkerField& field) {
  std::normal_distribution<double> noise(0.0, sigma_px);
  for (std::size_t m = 0; m < field.valid.size(); ++m) {
    if (!field.valid[m]) continue;
    for (std::size_t c = 0; c < 2; ++c) field.displacement_px[2 * m + c] += static_cast<float>(noise(generator));
    field.variance_px2[m] += static_cast<float>(sigma_px * sigma_px);
  }
}

/// Reads and writes more than the caches hold.
void emptyCaches() {
  static std::vector<std::uint8_t> more(std::size_t{64} << 20);
  for (std::uint8_t& each : more) ++each;
}

void run(const Options& options) {
  const sensor::Sensor sensor = loadSensor(options.gel);
  const sensor::Sensor seen = options.twinGel.empty() ? sensor : loadSensor(options.twinGel);
  const Config config = options.config.empty() ? Config{} : expect(loadConfig(options.config));
  const Job job(options, seen.markerCount());

  std::unique_ptr<solve::FieldSolver> solver = expect(solve::makeSolver(sensor, config.solve, options.state)).solver;
  const auto format = twin::formatByName(options.format);
  if (!format) fail("no format " + options.format + ", but " + twin::formatNames());
  Eye eye(seen, options.optics, options.seed, *format);
  if (!job.scatter.empty()) eye.scatter(Eigen::Map<const sensor::Points>(job.scatter.data(), 3, job.markers));
  const Eigen::Matrix2Xd rest = eye.project(eye.rest(), {});
  Eigen::Matrix2Xd last = rest;
  std::mt19937_64 generator(options.seed);
  std::unique_ptr<track::Tracker> tracker;
  MarkerField markers;
  TractionField field;
  markers.resize(sensor.markerCount());
  field.resize(sensor.markerCount(), sensor.nodes.count());
  TractionField learnt = field;
  track::CreepMemory creep(sensor.creep, sensor.markerCount());
  calibrate::ZeroTracking zeroTracking(sensor, config.track.followsDrift);

  // As the daemon does at a zero; here only at the first one, as others show the same gel.
  bool followsRest = solve::followsRest(sensor);
  const auto follow = [&](std::span<const float> place_px, std::span<const std::uint8_t> present) {
    if (!std::exchange(followsRest, false)) return;
    solver = expect(solve::makeSolverAtRest(sensor, config.solve, options.state, place_px, present,
                                            solver->detectionLimit_N()))
                 .solver;
  };
  if (options.given_px >= 0.0) {
    const Eigen::Matrix2Xf place = rest.cast<float>();
    const std::vector<std::uint8_t> present(static_cast<std::size_t>(rest.cols()), 1);
    follow({place.data(), static_cast<std::size_t>(place.size())}, present);
  }
  RestPose zero;

  std::filesystem::remove(options.job / "columns");
  const std::size_t most = options.brief ? 400 : std::numeric_limits<std::size_t>::max();
  Columns out(options.job, {}, most), answers(options.job, "answer_", most);
  for (std::size_t frame = 0; frame < job.frames; ++frame) {
    const Stray stray = job.strayAt(frame);
    Eigen::Matrix2Xd places = eye.project(job.at(frame), stray);
    const Eigen::Matrix2Xd here = places;
    for (Eigen::Index m = 0; m < places.cols(); ++m) {
      if (job.isMissing(frame, m)) places.col(m).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    std::int64_t begin_ns = monotonicNow();
    if (options.given_px >= 0.0) {
      for (Eigen::Index m = 0; m < places.cols(); ++m) {
        const std::size_t index = static_cast<std::size_t>(m);
        const bool there = !job.isMissing(frame, m);
        markers.valid[index] = there;
        markers.variance_px2[index] = 0.0F;
        for (int c = 0; c < 2; ++c) {
          markers.displacement_px[2 * index + static_cast<std::size_t>(c)] =
              there ? static_cast<float>(here(c, m) - rest(c, m)) : 0.0F;
        }
      }
      markers.zero = {1};
      markers.validCount = static_cast<int>(std::count(markers.valid.begin(), markers.valid.end(), 1));
      if (options.sameNoise) generator.seed(options.seed);
      addNoise(options.given_px, generator, markers);
    } else {
      if (!tracker || (options.zeroEvery > 0 && frame % static_cast<std::size_t>(options.zeroEvery) == 0)) {
        eye.light(options.litAtZero ? job.highlightAt(frame) : std::array<double, 4>{});
        tracker = trackerAtRest(sensor, config.track, eye, markers, &zero);
        follow(zero.position_px, zero.present);
        last = rest;
      }
      eye.light(job.highlightAt(frame));
      // A load is not put on in one frame: the way there is shown, and not judged.
      const double way = (here - last).colwise().norm().maxCoeff();
      const int steps = static_cast<int>(std::ceil(way / options.largestStep_px));
      for (int i = 1; i < steps; ++i) {
        const Eigen::Matrix2Xd between = last + (here - last) * i / steps;
        tracker->track(eye.shoot(between, stray.brightness), markers);
      }
      const Frame picture = eye.shoot(places, stray.brightness);
      last = here;
      if (options.cold) emptyCaches();
      begin_ns = monotonicNow();
      tracker->track(picture, markers);
    }
    const std::int64_t tracked_ns = monotonicNow();
    markers.info.frameNumber = frame;
    if (options.extra_px > 0.0) addNoise(options.extra_px, generator, markers);
    if (!job.time_s.empty()) {
      markers.info.times.captured_ns = 1 + std::llround(1e9 * job.time_s[frame]);
      markers.info.times.received_ns = markers.info.times.captured_ns;
    }
    if (!job.time_s.empty()) zeroTracking.takeOff(markers);
    creep.advance(markers);
    if (!job.time_s.empty()) zeroTracking.watch(markers);
    if (options.answer) {
      out.add("answered", solver->answer(markers, field));
      write(field, answers);
    }
    const std::int64_t solving_ns = monotonicNow();
    const bool isAnswered = options.asDaemon && solver->answer(markers, field);
    if (options.asDaemon) out.add("answered", isAnswered);
    if (!isAnswered) solver->solve(markers, field);
    const std::int64_t solved_ns = monotonicNow();
    if (isAnswered && field.method == Method::kContact && solver->wantsModel()) {
      solver->solve(markers, learnt);
      solver->learn();
    }
    if (!isAnswered && (options.answer || options.asDaemon)) solver->learn();
    write(field, out);
    out.add("track_ms", 1e-6 * static_cast<double>(tracked_ns - begin_ns));
    out.add("solve_ms", 1e-6 * static_cast<double>(solved_ns - solving_ns));
    const Eigen::Matrix2Xd moved = here - rest;
    out.add("true_px", std::span(moved.data(), static_cast<std::size_t>(moved.size())));
  }
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Displacements of markers through the whole chain.", "evaluation_chain");
  app.add_option("job", options.job, "folder of the frames and the results")->required();
  app.add_option("--state", options.state, "where factors are kept")->required();
  app.add_option("--gel", options.gel, "gel file; default the paper's");
  app.add_option("--twin-gel", options.twinGel, "gel file of what the camera sees; default the same");
  app.add_option("--config", options.config, "configuration, of which [track] and [solve] count");
  app.add_option("--background", options.optics.background, "levels")->capture_default_str();
  app.add_option("--format", options.format, "of the pictures")->capture_default_str();
  app.add_option("--given", options.given_px, "no pictures: displacements with this noise [px]");
  app.add_flag("--same-noise", options.sameNoise, "the given noise is the same in every frame");
  app.add_flag("--lit-at-zero", options.litAtZero, "the highlight is there when the zero is taken");
  app.add_option("--extra", options.extra_px, "noise added to the tracker's displacements [px]");
  app.add_option("--zero-every", options.zeroEvery, "frames after which a new zero is taken");
  app.add_flag("--brief", options.brief, "write nothing of single markers and nodes");
  app.add_flag("--cold", options.cold, "empty the caches before each frame");
  app.add_flag("--answer", options.answer, "answer each frame by the model of the frame before as well");
  app.add_flag("--as-daemon", options.asDaemon, "answer by earlier models, as the daemon does");
  app.add_option("--seed", options.seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  run(options);
}
