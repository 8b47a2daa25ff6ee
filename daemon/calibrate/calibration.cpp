#include "daemon/calibrate/calibration.h"

#include "base/clock.h"
#include "base/hash.h"
#include "base/quantile.h"
#include "base/whole_file.h"
#include "daemon/calibrate/zero_check.h"
#include "sensor/gel_file.h"
#include "sensor/measured_with.h"

#include <Eigen/Geometry>
#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

namespace tractiond::calibrate {

namespace {

namespace fs = std::filesystem;
using Kind = CalibrationStep::Kind;

constexpr double kLongest_s = 3600.0;  // longest duration of a step
constexpr double kNoise_s = 5.0;       // duration of the noise step, unless the request states it
constexpr double kPatience_s = 60.0;   // longest wait for a weight, unless the request states it
constexpr double kSettle_s = 1.5;      // for which a weight must have been still: most of a gel's creep is over then
constexpr int kWeightFrames = 60;      // averaged after that
constexpr double kCreep_s = 60.0;      // for which a load stays and the gel recovers, unless the request states it
constexpr double kOther = 0.15;        // relative change of a load that makes it another weight
constexpr double kShortestCreep_s = 10.0;  // a shorter one shows nothing but how the load was put on
constexpr double kLargest_N = 1e6;         // weight that a gel file can hold
constexpr double kFarFromTheFile = 3.0;    // deviations of the focal length that are worth a remark
constexpr double kBadResidual_px = 0.3;
constexpr double kBadCreep = 0.005;  // of the load's displacement: what the terms may leave
constexpr double kCreeping = 0.005;  // growth of a load's displacement between the halves of its reading
// A residual above both shows that the load is not a single round contact: relative to the noise, and in pixels, as
// markers of a real gel do not move as exactly as the block that is computed.
constexpr double kResidualOver = 2.0;
constexpr double kResidualFloor_px = 0.02, kResidualFloorShare = 0.02;  // the latter of the largest displacement

std::tm utc() {
  return fmt::gmtime(static_cast<std::time_t>(realNow() / 1'000'000'000));
}

std::string date() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", utc());
}

constexpr const char* kWithCreep =
    "Young's modulus is that of some seconds after a touch: read the weights, without creep";

tl::unexpected<std::string> refused(const std::string& sentence) {
  return tl::unexpected(sentence);
}

/// Returns which markers are valid, and not much less exact than most: the scatter of all, by which a motion is
/// recognized, says nothing of those that the rim of a body shows foreshortened.
std::vector<std::uint8_t> exactMarkers(const MarkerField& field) {
  constexpr float kMost = 4.0F;  // times the median variance
  std::vector<float> variances;
  for (std::size_t i = 0; i < field.valid.size(); ++i) {
    if (field.valid[i] != 0) variances.push_back(field.variance_px2[i]);
  }
  if (variances.empty()) return std::vector<std::uint8_t>(field.valid.size(), 0);
  const float most = kMost * quantile(variances);
  std::vector<std::uint8_t> exact(field.valid.begin(), field.valid.end());
  for (std::size_t i = 0; i < exact.size(); ++i) {
    if (field.variance_px2[i] > most) exact[i] = 0;
  }
  return exact;
}

}  // namespace

/// The reading from which the gel's thickness is determined best.
struct Calibration::Heaviest {
  ContactReading reading;
  std::vector<float> mean, variance;
  std::vector<std::uint8_t> valid;
};

/// Waits for a weight that is still and is not the previous one; then averages its displacements.
struct Calibration::Weighing {
  explicit Weighing(std::size_t markers)
      : sums{std::vector<double>(2 * markers), std::vector<double>(2 * markers)}
      , counts{std::vector<int>(markers), std::vector<int>(markers)}
      , variance(markers) {}

  std::vector<float> reference;     ///< displacements in the frame since which nothing moved; empty: none yet
  std::vector<std::uint8_t> exact;  ///< of these: as exactMarkers()
  int changed = 0;                  ///< frames up to this one that differ from the reference
  std::int64_t stillSince_ns = 0;
  int frames = 0;                           ///< number of frames in the sums
  std::array<std::vector<double>, 2> sums;  ///< sums over the first and the second half of the reading
  std::array<std::vector<int>, 2> counts;
  std::vector<double> variance;
};

Calibration::Calibration(const sensor::Sensor& inForce, int zeroFrames)
    : inForce_(inForce)
    , zeroFrames_(zeroFrames)
    , candidate_(inForce) {}

Calibration::~Calibration() = default;

sensor::Calibration& Calibration::made() {
  measured_ = true;
  if (!candidate_.calibration) candidate_.calibration.emplace();
  return *candidate_.calibration;
}

std::optional<Result> Calibration::begin(const CalibrationStep& step, const RestPose* zero, const std::string& camera,
                                         const fs::path& directory) {
  running_.reset();
  if (step.kind != Kind::kRecovery) creep_.reset();
  if (step.kind == Kind::kStiffness) return stiffness();
  if (step.kind == Kind::kFinish) return finish(step.name, camera, directory);
  if (zero == nullptr) return refused("there is no zero yet: take one with nothing touching the gel");
  if (step.kind == Kind::kGeometry) return geometry(*zero, step.anyway);
  if (step.kind == Kind::kWeight) {
    if (!(step.weight_N > 0.0)) return refused("a weight must press: it is above 0");
    if (step.weight_N > kLargest_N) return refused("a weight is at most 1,000,000 N");
    if (inForce_.body && std::min(inForce_.nodes.columns, inForce_.nodes.rows) < BodySurface::kFewest) {
      return refused(
          fmt::format("weights on a body need an influence file with {0} x {0} nodes or more", BodySurface::kFewest));
    }
    if (step.first) {
      weights_.clear();
      heaviest_.reset();
    }
    if (!contactFit_) contactFit_ = std::make_unique<ContactFit>(inForce_);
    weighing_ = std::make_unique<Weighing>(zero->present.size());
  } else if (step.kind == Kind::kCreep) {
    const double held_s = step.seconds > 0.0 ? std::min(step.seconds, kLongest_s) : kCreep_s;
    if (held_s < kShortestCreep_s)
      return refused(
          fmt::format("a load must stay for {:.0f} s at least to show how the gel creeps", kShortestCreep_s));
    creep_ = std::make_unique<CreepReading>(inForce_, held_s);
  } else if (step.kind == Kind::kRecovery) {
    if (!creep_ || !creep_->hasHeld())
      return refused(
          "there is no load whose end could be watched: it must have stayed for a step \"creep\" just before");
  } else {
    noise_ = std::make_unique<RestNoiseMeter>(candidate_);
  }
  running_ = step;
  if (!(step.seconds > 0.0)) running_->seconds = step.kind == Kind::kNoise ? kNoise_s : kPatience_s;
  running_->seconds = std::min(running_->seconds, kLongest_s);
  if (creep_) running_->seconds = CreepReading::kPatience_s + creep_->held_s();
  begun_ns_ = 0;
  frames_ = unusable_ = 0;
  return std::nullopt;
}

void Calibration::drop() {
  running_.reset();
  creep_.reset();
}

std::optional<Result> Calibration::add(const MarkerField& field) {
  if (memory_) {
    withMemory_ = field;
    memory_->advance(withMemory_);
  }
  if (!running_) {
    if (creep_ && (field.flags & kFewMarkers) == 0) creep(field);
    return std::nullopt;
  }
  if (begun_ns_ == 0) begun_ns_ = field.info.times.received_ns;
  ++frames_;
  std::optional<Result> result;
  if ((field.flags & kFewMarkers) != 0) {
    ++unusable_;
  } else {
    result = creep_                           ? creep(field)
             : running_->kind == Kind::kNoise ? noise(field)
                                              : weigh(memory_ ? withMemory_ : field);
  }
  if (!result) result = overdue(field);
  if (result) running_.reset();
  return result;
}

bool Calibration::nextTakesLong() const {
  return running_ && running_->kind == Kind::kWeight && weighing_->frames + 1 >= kWeightFrames;
}

std::optional<Result> Calibration::overdue(const MarkerField& field) const {
  const double elapsed_s = 1e-9 * static_cast<double>(field.info.times.received_ns - begun_ns_);
  if (elapsed_s < running_->seconds + kGrace_s) return std::nullopt;
  if (2 * unusable_ > frames_) {
    return refused(fmt::format("too few markers were seen in {} of {} frames: is something in front of the camera?",
                               unusable_, frames_));
  }
  return refused(fmt::format("frames come too slowly: {} in {:.0f} s", frames_, elapsed_s));
}

Result Calibration::geometry(const RestPose& zero, bool anyway) {
  const Geometry found = fitGeometry(inForce_, zero.position_px, zero.present);
  if (found.outcome == Geometry::Outcome::kFewMarkers)
    return refused(
        fmt::format("the zero shows {} of {} markers, and at least {} must agree with each other for a geometry",
                    std::ranges::count(zero.present, 1), zero.present.size(), GeometryOptions{}.fewest));
  if (found.outcome == Geometry::Outcome::kDiverged) {
    return refused("no camera explains the markers' places: is the gel file that of another gel?");
  }
  if (found.bulge.found() && !anyway) {
    return refused(touching(found.bulge) + "; take it away and zero again, or calibrate anyway");
  }
  candidate_.camera = found.camera;
  candidate_.uncertainty.focal = found.uncertainty.focal;
  candidate_.uncertainty.position = found.uncertainty.position;
  candidate_.uncertainty.rotation = found.uncertainty.rotation;
  candidate_.uncertainty.focalDistance = found.uncertainty.focalDistance;
  made().geometry = date();
  weights_.clear();  // they were read with the previous geometry
  heaviest_.reset();
  made().residual_px = found.residual_px;

  CalibrationReport report;
  const sensor::Camera& camera = found.camera;
  const sensor::Uncertainty& known = found.uncertainty;
  report.figures = {{"residual_px", found.residual_px, 0.0},
                    {"markers", static_cast<double>(found.markers), 0.0},
                    {"outliers", static_cast<double>(found.outliers), 0.0},
                    {"focal_px", camera.focal_px, camera.focal_px * known.focal},
                    {"principal_u_px", camera.principal_px.x(), found.principalDeviation_px},
                    {"principal_v_px", camera.principal_px.y(), found.principalDeviation_px},
                    {"k1", camera.k1, found.k1Deviation},
                    {"k2", camera.k2, found.k2Deviation}};
  const std::array axes = {"x", "y", "z"};
  for (int i = 0; i < 3; ++i) {
    report.figures.push_back(
        {std::string("position_") + axes[i] + "_mm", 1e3 * camera.position[i], 1e3 * known.position[i]});
  }
  for (int i = 0; i < 3; ++i) {
    report.figures.push_back({std::string("rotation_") + axes[i] + "_rad", camera.rotation[i], known.rotation[i]});
  }
  report.figures.push_back({"focal_distance_correlation", known.focalDistance, 0.0});
  if (!inForce_.body) {
    report.remarks.push_back(fmt::format(
        "focal length and distance, principal point and sideways position are known together much better than "
        "alone: {} little but the picture's scale and place",
        inForce_.layers.size() == 1 ? "one layer shows" : "two layers that lie so close show"));
  }
  const double off = std::abs(camera.focal_px / inForce_.camera.focal_px - 1.0);
  if (off > kFarFromTheFile * inForce_.uncertainty.focal) {
    report.remarks.push_back("the focal length is far from the file's: is uncertainty.focal_relative too small?");
  }
  if (found.residual_px > kBadResidual_px) {
    report.remarks.push_back("the residual is large: the markers are not where the file has them");
  }
  if (found.bulge.found()) report.remarks.push_back(touching(found.bulge));
  return report;
}

std::optional<Result> Calibration::noise(const MarkerField& field) {
  const int before = noise_->frames();
  noise_->add(field);
  if (noise_->frames() == before) ++unusable_;
  const double elapsed_s = 1e-9 * static_cast<double>(field.info.times.received_ns - begun_ns_);
  if (elapsed_s < running_->seconds || noise_->frames() < RestNoiseMeter::kFewestFrames) return std::nullopt;
  const RestNoise found = noise_->summary();
  if (found.bulge.found() && !running_->anyway) {
    return refused(touching(found.bulge) + "; take it away, or zero again if nothing does");
  }
  candidate_.pictureMotion = found.motion;
  made().noise = date();
  made().noise_px = found.centre_px;
  CalibrationReport report;
  report.figures = {{"frames", static_cast<double>(found.frames), 0.0},
                    {"noise_px", found.centre_px, 0.0},
                    {"noise_over_promised", found.overPromised, 0.0},
                    {"shift_px", found.motion.shift_px, 0.0},
                    {"scale", found.motion.scale, 0.0},
                    {"roll_rad", found.motion.roll, 0.0}};
  report.remarks.push_back(
      fmt::format("the picture's motion is that of {:.0f} s: heat over hours may move it farther", elapsed_s));
  if (found.overPromised > 1.2 || found.overPromised < 0.8) {
    report.remarks.push_back("the markers' noise is not what the tracker promises: zero again");
  }
  return report;
}

std::optional<Result> Calibration::creep(const MarkerField& field) {
  const auto found = creep_->add(field);
  if (!found) return std::nullopt;
  if (!*found) {
    creep_.reset();
    return refused(found->error());
  }
  const Creep& creep = **found;
  const bool isHeld = creep.fit.now > 0.0;
  if (!isHeld) creep_.reset();
  candidate_.creep = creep.fit.terms;
  made();
  weights_.clear();  // they were read with other creep
  heaviest_.reset();
  const Eigen::VectorXd load_px = creep.fit.load * creep.pattern_px;
  memory_ = std::make_unique<track::CreepMemory>(candidate_.creep, candidate_.markerCount());
  memory_->resume(creep.zero, creep.time_ns, creep.fit.now * load_px, load_px * creep.fit.follows.transpose());

  CalibrationReport report;
  for (const sensor::CreepTerm& term : candidate_.creep)
    report.figures.push_back({fmt::format("share_of_{:g}_s", term.time_s), term.share, term.deviation});
  report.figures.push_back({"error", creep.fit.error, 0.0});
  if (isHeld) report.remarks.push_back("how the gel recovers makes this more certain: take the load away");
  if (creep.fit.error > kBadCreep) {
    report.remarks.push_back(
        fmt::format("the load's displacement differs by {:.1f} % from what any such creep explains: "
                    "did it stand still, and was the temperature constant?",
                    100.0 * creep.fit.error));
  }
  report.remarks.push_back(kWithCreep);
  return report;
}

std::optional<Result> Calibration::weigh(const MarkerField& field) {
  Weighing& w = *weighing_;
  const std::int64_t now_ns = field.info.times.received_ns;
  const PictureMotionFit fit(candidate_);
  const auto motion = fit({field.byForces_px(), field.valid});
  if (!motion) {
    ++unusable_;
    return std::nullopt;
  }
  const std::vector<float> deformation = fit.without(motion->value, field.byForces_px());
  std::vector<float> change(deformation.size());
  const auto changeFrom = [&](const std::vector<float>& from, std::span<const std::uint8_t> valid) {
    for (std::size_t i = 0; i < change.size(); ++i) change[i] = deformation[i] - from[i];
    return largestBulge(candidate_, {change, valid}, kUntouched_px);
  };
  const Bulge load = largestBulge(candidate_, {deformation, field.valid}, kUntouched_px);
  if (!load.found()) lastWeight_px_.clear();
  const bool isNew = lastWeight_px_.empty() || changeFrom(lastWeight_px_, field.valid).size_px > kOther * load.size_px;
  bool moved = w.reference.empty();
  const std::vector<std::uint8_t> exact = exactMarkers(field);
  if (!moved) {
    std::vector<std::uint8_t> inBoth = exact;
    for (std::size_t i = 0; i < inBoth.size(); ++i) inBoth[i] &= w.exact[i];
    // In two frames one after the other: noise of one frame is no motion.
    w.changed = changeFrom(w.reference, inBoth).found() ? w.changed + 1 : 0;
    moved = w.changed >= 2;
  }
  if (moved || !load.found() || !isNew) {
    w = Weighing(field.valid.size());
    w.reference = deformation;
    w.exact = exact;
    w.stillSince_ns = now_ns;
    if (1e-9 * static_cast<double>(now_ns - begun_ns_) < running_->seconds) return std::nullopt;
    if (!load.found()) return refused("no weight was put on the gel");
    if (!isNew) return refused("the weight was not changed");
    return refused("the weight did not come to rest");
  }
  if (1e-9 * static_cast<double>(now_ns - w.stillSince_ns) < kSettle_s) return std::nullopt;
  const int half = w.frames < kWeightFrames / 2 ? 0 : 1;
  for (std::size_t i = 0; i < field.valid.size(); ++i) {
    if (!field.valid[i]) continue;
    w.sums[half][2 * i] += field.byForces_px()[2 * i];
    w.sums[half][2 * i + 1] += field.byForces_px()[2 * i + 1];
    ++w.counts[half][i];
    w.variance[i] += field.variance_px2[i];
  }
  if (++w.frames < kWeightFrames) return std::nullopt;
  lastWeight_px_ = deformation;
  return read();
}

Result Calibration::read() {
  const Weighing& w = *weighing_;
  const std::size_t markers = w.variance.size();
  std::vector<float> mean(2 * markers), variance(markers);
  std::vector<std::uint8_t> valid(markers);
  double both = 0.0, first = 0.0;
  for (std::size_t i = 0; i < markers; ++i) {
    const int count = w.counts[0][i] + w.counts[1][i];
    if (w.counts[0][i] == 0 || w.counts[1][i] == 0) continue;
    valid[i] = 1;
    // The tracker's variance includes that of the zero, which averaging over frames does not reduce.
    const double ofZero = 1.0 / zeroFrames_;
    variance[i] = static_cast<float>(w.variance[i] / count / (1.0 + ofZero) * (1.0 / count + ofZero));
    for (const std::size_t c : {2 * i, 2 * i + 1}) {
      mean[c] = static_cast<float>((w.sums[0][c] + w.sums[1][c]) / count);
      const double before = w.sums[0][c] / w.counts[0][i], after = w.sums[1][c] / w.counts[1][i];
      both += before * after;
      first += before * before;
    }
  }
  auto reading = (*contactFit_)(candidate_, {mean, valid}, variance);
  if (!reading) return refused("the markers' displacements are not those of a weight");
  // A block lies; of a body nobody knows how it is turned, so a weight is all of the force.
  const auto stated = Eigen::Vector3d::Map(running_->direction.data());
  if (stated.squaredNorm() > 0.0) {
    reading->along = stated.normalized();
  } else if (inForce_.body) {
    reading->along = reading->force.normalized();
  }
  const double read_N = reading->force.dot(reading->along);
  weights_.push_back({running_->weight_N, read_N, std::sqrt(reading->along.dot(reading->covariance * reading->along))});
  if (!heaviest_ || read_N > heaviest_->reading.force.dot(heaviest_->reading.along)) {
    heaviest_ = std::make_unique<Heaviest>(Heaviest{*reading, mean, variance, valid});
  }
  const double creep = first > 0.0 ? both / first - 1.0 : 0.0;

  CalibrationReport report;
  const auto grams = [](double newtons) { return newtons / kGramForce; };
  report.figures = {{"weight_gf", grams(running_->weight_N), 0.0},
                    {"reading_gf", grams(read_N), grams(weights_.back().deviation_N)},
                    {"shear_gf", grams(reading->force.cross(reading->normal).norm()), 0.0},
                    {"x_mm", 1e3 * reading->place.x(), 0.0},
                    {"y_mm", 1e3 * reading->place.y(), 0.0},
                    {"radius_mm", 1e3 * reading->radius, 0.0},
                    {"residual_px", reading->residual_px, 0.0},
                    {"creep", creep, 0.0}};
  if (inForce_.body) report.figures.push_back({"z_mm", 1e3 * reading->place.z(), 0.0});
  double largest_px = 0.0;
  for (std::size_t i = 0; i < markers; ++i) {
    if (valid[i]) largest_px = std::max(largest_px, std::hypot(double{mean[2 * i]}, double{mean[2 * i + 1]}));
  }
  if (reading->residual_px >
      std::max({kResidualOver * reading->expected_px, kResidualFloor_px, kResidualFloorShare * largest_px})) {
    report.remarks.push_back("the weight does not stand on one round contact, or something else touches");
  }
  if (creep > kCreeping) report.remarks.push_back("the gel still creeps: wait longer after putting the weight on");
  return report;
}

Result Calibration::stiffness() {
  if (weights_.empty()) return refused("no weight has been read");
  // On a body the weights stand in several places, and its mechanics err otherwise in each.
  const double model = inForce_.body ? inForce_.uncertainty.model : 0.0;
  const Stiffness found = fitStiffness(weights_, inForce_.gel.youngsModulus, model);
  if (!found.contradiction.empty()) return refused(found.contradiction);
  if (!thicknessCheck_) thicknessCheck_ = std::make_unique<ThicknessCheck>(inForce_, *contactFit_);
  const Displacements heaviest{heaviest_->mean, heaviest_->valid};
  const double absorbed = thicknessCheck_->absorbed(candidate_, heaviest, heaviest_->variance, heaviest_->reading);
  const auto thickness = (*thicknessCheck_)(candidate_, heaviest, heaviest_->variance, heaviest_->reading);
  candidate_.gel.youngsModulus = found.youngsModulus;
  candidate_.uncertainty.youngsModulus = found.deviation;
  sensor::Calibration& record = made();
  record.stiffness = date();
  record.linearity = found.linearity;
  record.weights.clear();
  record.readings.clear();
  CalibrationReport report;
  report.figures = {
      {"youngs_modulus_pa", found.youngsModulus, std::hypot(found.deviation, absorbed) * found.youngsModulus},
      {"linearity", found.linearity, 0.0}};
  for (std::size_t i = 0; i < weights_.size(); ++i) {
    record.weights.push_back(weights_[i].weight_N);
    record.readings.push_back(weights_[i].read_N * found.youngsModulus / inForce_.gel.youngsModulus);
    std::string name = fmt::format("youngs_modulus_by_{:.4g}_gf_pa", weights_[i].weight_N / kGramForce);
    if (std::ranges::count(report.figures, name, &CalibrationReport::Figure::name) > 0) {
      name = fmt::format("{}_{}", name, i + 1);  // the same weight in another place
    }
    report.figures.push_back({name, found.ofEach[i], found.ofEach[i] * weights_[i].deviation_N / weights_[i].read_N});
  }
  // The file's deviation stays that of a press: the solver takes off what the modulus has taken up.
  report.remarks.push_back(fmt::format(
      "a press like the weights is known to ± {:.2f} %; as the material's, the modulus is known to ± {:.2f} "
      "% only, as it takes up errors of {} and the camera's pose",
      100.0 * found.deviation, 100.0 * std::hypot(found.deviation, absorbed),
      inForce_.body ? "the influence file" : "thickness, depths, Poisson's ratio"));
  if (weights_.size() < 2) report.remarks.push_back("one weight alone cannot be checked by another");
  if (!thickness) return report;
  const double expected = inForce_.gel.size.z();
  report.figures.push_back({"thickness_mm", 1e3 * thickness->thickness, 1e3 * thickness->deviation});
  if (thickness->contradicts(expected)) {
    report.remarks.push_back(
        fmt::format("under the heaviest weight the markers move as in a block {:.1f} ± {:.1f} mm thick, the file's has "
                    "{:.1f} mm: check thickness_mm, and calibrate again",
                    1e3 * thickness->thickness, 1e3 * thickness->deviation, 1e3 * expected));
  }
  return report;
}

Result Calibration::finish(const std::string& name, const std::string& camera, const fs::path& directory) {
  if (!measured_) {
    return refused("nothing has been measured since " +
                   (written_.empty() ? "the start of the daemon" : written_ + " was written"));
  }
  if (camera.empty()) return refused("no camera has been seen yet");
  sensor::Sensor sensor = candidate_;
  sensor::Calibration& record = *sensor.calibration;
  sensor.measuredWith = camera;
  record.camera = sensor::MeasuredWith::parse(camera).camera;
  record.date = date();
  record.hash = calibrationHash(sensor);
  const std::string stem = fmt::format("{}-{:%Y%m%dT%H%M%SZ}", name.empty() ? "gel" : name, utc());
  fs::path path = directory / (stem + ".toml");
  std::error_code ignored;
  for (int i = 2; fs::exists(path, ignored); ++i) path = directory / (stem + "-" + std::to_string(i) + ".toml");
  const std::string text = "# Calibrated by tractiond; a changed number makes it void.\n" + sensor::gelText(sensor);
  if (const std::error_code error = replaceWholeFile(path, text)) {
    return refused(path.string() + " cannot be written: " + error.message());
  }
  measured_ = false;
  written_ = path.string();
  CalibrationReport report;
  report.path = written_;
  report.gelFile = text;
  if (memory_ && weights_.empty()) report.remarks.push_back(kWithCreep);
  report.remarks.push_back("it counts once sensor.gel_file names it and tractiond is started again");
  return report;
}

std::string calibrationHash(const sensor::Sensor& sensor) {
  sensor::Sensor plain = sensor;
  if (plain.calibration) plain.calibration->hash.clear();
  Hasher hasher;
  const std::string text = sensor::gelText(plain);
  hasher.bytes(text.data(), text.size());
  if (plain.body) {
    const sensor::Body& body = *plain.body;
    const auto add = [&hasher](const auto& numbers) {
      hasher.range(std::span(numbers.data(), static_cast<std::size_t>(numbers.size())));
    };
    hasher.value(body.youngsModulus);
    add(body.influence);
    for (const Eigen::MatrixXd& each : body.errors) add(each);
    add(body.nodes);
    add(body.normals);
    add(body.areas);
    add(body.markers);
  }
  return toHex(hasher.digest());
}

tl::expected<void, Error> verifyCalibration(const sensor::Sensor& sensor, const std::string& path) {
  if (!sensor.calibration || sensor.calibration->hash == calibrationHash(sensor)) return {};
  return tl::unexpected(
      Error{.exitCode = EX_CONFIG,
            .what = "the gel file was changed after its calibration: its hash does not fit",
            .where = path,
            .remedy = "calibrate again, or delete its lines of calibration to vouch for it yourself"});
}

}  // namespace tractiond::calibrate
