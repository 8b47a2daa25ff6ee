#include "daemon/app/measurement.h"

#include "daemon/app/gel_files.h"
#include "daemon/control/zero_store.h"
#include "daemon/publish/wire_parts.h"
#include "daemon/solve/make_solver.h"
#include "daemon/track/nominal.h"

#include <spdlog/spdlog.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <thread>
#include <utility>

namespace tractiond {
namespace {

/// Returns a function that logs a line for each step of a new gel, and each ten per cent of one whose share is known.
solve::Steps stepLines() {
  return [last = -1, isNew = false](solve::Step step, double done) mutable {
    constexpr std::array<const char*, 5> kNames{"influence", "products", "modes", "systematic errors",
                                                "detection limit"};
    const auto index = static_cast<std::size_t>(step);
    isNew = isNew || step == solve::Step::kInfluence || step == solve::Step::kProducts;
    const int line = 10 * static_cast<int>(index) + std::min(static_cast<int>(done * 10), 9);
    if (!isNew || line == std::exchange(last, line)) return;
    spdlog::info("a gel not seen before: computing its factors, step {} of {}: {}{}", index + 1, kNames.size(),
                 kNames.at(index), step == solve::Step::kInfluence ? fmt::format(", {} %", 10 * (line % 10)) : "");
  };
}

}  // namespace

tl::expected<std::unique_ptr<Processing>, Error> Measurement::make(sensor::Sensor sensor, const Surroundings& around) {
  std::unique_ptr<Measurement> measurement(new Measurement(std::move(sensor), around));
  if (auto built = measurement->build(); !built) return tl::unexpected(built.error());
  return measurement;
}

Measurement::Measurement(sensor::Sensor sensor, const Surroundings& around)
    : around_(around)
    , isFilm_(!around.config.camera.images.empty())
    , sensor_(std::move(sensor))
    , creep_(sensor_.creep, sensor_.markerCount())
    , zeroTracking_(sensor_, around.config.track.followsDrift) {
  if (!isFilm_) promptSolver_.emplace(around.config.prompt, sensor_.markerCount(), sensor_.nodes.count());
  constexpr int kNice = 10;  // of this thread only: frames are more urgent
  compute_.run([] { setpriority(PRIO_PROCESS, 0, kNice); });
}

Measurement::~Measurement() {
  restSolver_.reset();
  compute_.awaitIdle();
  disk_.awaitIdle();
}

tl::expected<void, Error> Measurement::build() {
  const Config& config = around_.config;
  auto made = solve::makeSolver(sensor_, config.solve, around_.stateDirectory, stepLines(),
                                [](const std::string& remark) { spdlog::warn("warning: {}", remark); });
  if (!made) return tl::unexpected(made.error());
  solver_.solver = std::move(made->solver);
  around_.description.message.mutable_calibration()->set_time_ns(made->computed_ns);
  if (solve::followsRest(sensor_)) {
    restSolver_ = std::make_unique<RestSolver>(sensor_, config.solve, around_.stateDirectory, solver_.solver, compute_);
  }
  track::TrackOptions tracking = config.track;
  tracking.awaitsGelCheck = true;  // forces are only computed from a zero that was compared with the gel file
  tracker_ = std::make_unique<track::Tracker>(sensor_, tracking);
  gelWatch_ = std::make_unique<control::GelWatch>(sensor_, *tracker_, newestMarkerStatus_, &around_.replies);
  publish::encode(solver_.solver->detectionLimit_N(), *around_.description.message.mutable_solver());
  around_.publisher.describe(around_.description);
  procedures_ = std::make_unique<control::Procedures>(
      control::ProcedureParts{.sensor = sensor_,
                              .frames = tracked_,
                              .markers = newestMarkers_,
                              .watched = watched_,
                              .tracker = *tracker_,
                              .gel = *gelWatch_,
                              .host = *this,
                              .replies = around_.replies},
      control::ProcedureOptions{.zeroFrames = config.track.zeroFrames, .directory = around_.stateDirectory});
  if (!config.record.file.empty()) {
    auto recorder = Recorder::open(config.record, around_.description.identity, sensor_.markerCount(),
                                   sensor_.nodes.count(), {.published = around_.publisher});
    if (!recorder) return tl::unexpected(recorder.error());
    recorder_ = *std::move(recorder);
    recordedConfig_ = configText(config);
  }
  return {};
}

PipelineOptions Measurement::pipelineOptions() const {
  return {.markers = sensor_.markerCount(),
          .nodes = sensor_.nodes.count(),
          .makesModels = promptSolver_.has_value(),
          .records = recorder_ != nullptr};
}

tl::expected<void, Error> Measurement::acceptCamera(const capture::CameraInfo& info) {
  if (auto fits = checkCamera(sensor_, info, around_.config.sensor.gelFile); !fits) return fits;
  const sensor::MeasuredWith with = tractiond::measuredWith(info);
  if (info.session > 1) {  // the zero of the previous session is in force
    if (measuredWith_.holdsFor(with)) return {};
    return tl::unexpected(
        Error{.exitCode = EX_UNAVAILABLE,
              .what = fmt::format("camera {} is not {}, whose zero is in force", with.text(), measuredWith_.text()),
              .remedy = "to use another camera, stop the daemon and set camera.id; another picture of "
                        "the same camera is set by camera.features"});
  }
  measuredWith_ = with;
  if (sensor_.measuredWith.empty() && !sensor_.calibration && !around_.config.sensor.gelFile.empty()) {
    spdlog::info(
        "the gel file does not say with which camera and picture its lens and pose were measured, so others are not "
        "noticed: tractionctl calibrate writes it, and traction-lens, from pictures of tractionctl snapshot");
  }
  // Without the earlier zero, a load that presses at the start would be zeroed.
  auto restored = control::restoreZero(around_.stateDirectory, {sensor_, info.format, with.text()});
  if (!restored) return tl::unexpected(restored.error());
  restored_ = *std::move(restored);
  if (restored_) {
    tracker_->restore(*restored_);
    creep_.doubt();
    zeroTracking_.resume(restored_->taken_ns);
  }
  auto earlier = control::loadEarlierZero(around_.stateDirectory, restored_, {sensor_, info.format, with.text()});
  // Needed for an undo only.
  if (!earlier) spdlog::warn("warning: the zero cannot be undone: {}", earlier.error().message());
  earlier_ = earlier.value_or(std::nullopt);
  if (recorder_) beginRecording(info);
  return {};
}

void Measurement::beginRecording(const capture::CameraInfo& info) {
  publish::Beginning beginning{.message = {}, .rest = restored_};
  beginning.message.set_sensor(around_.config.sensor.name);
  beginning.message.set_software_version(TRACTIOND_VERSION);
  beginning.message.set_calibration(publish::bytesOf(around_.description.identity.calibration));
  beginning.message.set_configuration(recordedConfig_);
  beginning.message.set_camera_vendor(info.name.vendor);
  beginning.message.set_camera_model(info.name.model);
  beginning.message.set_camera_serial(info.name.serial);
  if (const auto read = readGelFiles(sensor_, around_.config.sensor.gelFile, beginning); !read)
    spdlog::warn("warning: {}", read.error().message());
  recorder_->begin(beginning);
}

bool Measurement::track(const Frame& frame, MarkerField& markers) {
  if (isFilm_) awaitFirstZero();
  const bool tracked = tracker_->track(frame, markers) == track::Outcome::kTracked;
  tracked_.add();
  if (restSolver_) restSolver_->advanceZero(places_);
  markers.places = places_;
  gelWatch_->takeFrame(frame);
  if (recorder_) recorder_->takeFrame(frame, tracker_->inputs(), places_);
  if (tracked) {
    zeroTracking_.takeOff(markers);
    creep_.advance(markers);
    zeroTracking_.watch(markers);
    newestMarkers_.put(markers);  // dropped if control is taking one at this moment
  }
  return tracked;
}

/// Waits, for pictures from a file, until the first zero is compared with the gel file and its solver is made: the time
/// that these take must not decide which pictures are measured, and by which solver.
void Measurement::awaitFirstZero() {
  if (!tracker_->awaitsFirstVerdict()) return;
  const auto waits = [this] { return tracker_->awaitsFirstVerdict() || (restSolver_ && restSolver_->done() == 0); };
  while (waits() && !around_.pipeline->stopping()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    around_.turns.track.add();
  }
}

void Measurement::solve(const MarkerField& markers, TractionField& field) {
  if (restSolver_) restSolver_->take(solver_, markers.places);
  if (promptSolver_) {
    promptSolver_->solve(solver_.solver, markers, field);
  } else {
    solver_.solver->solve(markers, field);
  }
}

void Measurement::takeField(const TractionField& field) {
  if (!field.valid) {
    around_.ledger.invalid.add();
    invalid_ = Invalid{field.flags, field.markers.validCount, static_cast<int>(field.markers.valid.size())};
  }
  if (recorder_) recorder_->takeField(field);
}

/// Explains the newest field that was not valid since the last call, and names the key that decides; empty: all were.
std::string Measurement::whyInvalid() {
  const auto invalid = std::exchange(invalid_, std::nullopt);
  if (!invalid) return "";
  if ((invalid->flags & kGelMismatch) != 0) return "the gel file does not fit the picture (sensor.gel_file)";
  if ((invalid->flags & kNotSolved) != 0) return "their frames were not solved in time (solve.patience_ms)";
  if ((invalid->flags & kFewMarkers) == 0) return "their numbers are not finite";
  const Config& config = around_.config;
  return fmt::format("{} of {} markers are found, too few or too uncertain (track.min_valid_fraction = {}, "
                     "solve.max_missing_fraction = {})",
                     invalid->found, invalid->markers, config.track.minValidFraction, config.solve.maxMissingFraction);
}

void Measurement::measure(traction::v1::Status& status) {
  watched_.take(lastWatched_);
  status.set_zero_within_s(lastWatched_.zeroWithin_s);
  newestMarkerStatus_.swap(*status.mutable_markers());
  status.set_invalid_why(whyInvalid());
  const RestDrift& drift = lastWatched_.drift;
  if (drift.seen_ns == 0) return status.clear_rest_drift();
  traction::v1::RestDrift& to = *status.mutable_rest_drift();
  to.set_shift_u_px(drift.shiftU_px);
  to.set_shift_v_px(drift.shiftV_px);
  to.set_scale(drift.scale);
  to.set_roll_rad(drift.roll);
  to.set_rms_px(drift.rms_px);
  to.set_age_s(std::max(static_cast<double>(monotonicNow() - drift.seen_ns) * 1e-9, 0.0));
}

void Measurement::beginSession(const capture::CameraInfo& info) {
  format_ = info.format;
  gelWatch_->setCamera(info.shape.size, info.waits());
  procedures_->setWaits(info.waits());
  if (std::exchange(hasSession_, true)) return;
  procedures_->restore(measuredWith_.text(), info.frameRate_Hz, restored_, earlier_);
}

void Measurement::turn() {
  procedures_->turn();
  gelWatch_->turn();
  if (restSolver_) restSolver_->turn();
}

void Measurement::describe(const RestPose& zero) {
  if (restSolver_) restSolver_->request(zero);
  publish::encode(zero, *around_.description.message.mutable_zero());
  around_.publisher.describe(around_.description);
}

std::future<tl::expected<void, Error>> Measurement::keep(const RestPose& zero, const RestPose* before) {
  return disk_.start([this, zero, format = format_, earlier = before ? std::optional(*before) : std::nullopt] {
    return control::saveZeros(around_.stateDirectory, zero, earlier ? &*earlier : nullptr,
                              {sensor_, format, measuredWith_.text()});
  });
}

std::future<std::optional<calibrate::Result>> Measurement::start(control::StepWork work) {
  return compute_.start(std::move(work));
}

tl::expected<void, Error> Measurement::finish() {
  gelWatch_->turn();  // the pictures of a file may have ended between two turns
  if (!recorder_) return {};
  auto closed = recorder_->close();
  if (closed) spdlog::info("recorded: {}", recorder_->account());
  return closed;
}

}  // namespace tractiond
