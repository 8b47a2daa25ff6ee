// Processes one picture after another in one thread. The recording states the zero with which the tracker began, and
// its inputs before each picture: with the same gel file the tracker computes the same fields again, to the bit. With
// another gel file the zeros are taken at the same pictures, and are compared with that file.
#include "daemon/app/replay.h"

#include "daemon/app/config.h"
#include "daemon/app/gel_files.h"
#include "daemon/app/instance.h"
#include "daemon/app/rest_solver.h"
#include "daemon/calibrate/zero_tracking.h"
#include "daemon/control/gel_watch.h"
#include "daemon/publish/wire_parts.h"
#include "daemon/record/recorder.h"
#include "daemon/record/replay_solver.h"
#include "daemon/records/field_gaps.h"
#include "daemon/solve/make_solver.h"
#include "daemon/track/creep_memory.h"
#include "daemon/track/nominal.h"
#include "daemon/track/rest_pose.h"
#include "proto/traction/v1/endpoints.h"
#include "recording/reader.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <thread>

namespace tractiond {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

volatile std::sig_atomic_t stopAsked = 0;

void onSignal(int) {
  stopAsked = 1;
}

/// The clocks of the recording at the present picture [ns].
std::atomic<std::int64_t> recordedMonotonic{0}, recordedReal{0};

std::int64_t monotonicOfRecording() {
  return recordedMonotonic.load(std::memory_order_relaxed);
}
std::int64_t realOfRecording() {
  return recordedReal.load(std::memory_order_relaxed);
}

/// Thrown to end the reading.
struct Stopped {
  std::optional<Error> error = {};
};

/// Returns the value, or ends the reading with the error.
template <typename Value>
Value orStop(tl::expected<Value, Error> result) {
  if (!result) throw Stopped{std::move(result).error()};
  return *std::move(result);
}

class Replay {
 public:
  Replay(Config config, Places places, ReplayOptions options)
      : config_(std::move(config))
      , places_(std::move(places))
      , options_(std::move(options)) {}

  tl::expected<void, Error> run();

 private:
  void begin(std::string_view bytes);
  void open(const Frame& first);
  void chooseSensor();
  void checkPicture(const Frame& picture) const;
  void makeSolver(const Frame& first);
  void openRecorder();
  void makeTracker();
  void picture(std::string_view bytes);
  void pace(std::int64_t received_ns);
  void require(const RestPose& pose) const;
  void describe(const RestPose& pose);
  PlacedSolver solverOf(const publish::TrackedFrame& frame);
  bool comparesZeros() const;
  bool compare(const RestPose& zero);
  void handleZero(TrackerInputs& inputs);
  [[noreturn]] void fail(Error error) const;

  Config config_;
  Places places_;
  ReplayOptions options_;
  std::optional<publish::Beginning> beginning_;
  bool sameGel_ = false;
  bool isOpen_ = false;
  sensor::Sensor sensor_;
  Ledger ledger_;
  publish::Description description_;
  std::optional<OwnDirectory> runtime_;
  std::unique_ptr<publish::Publisher> publisher_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<track::Tracker> tracker_;
  std::shared_ptr<solve::FieldSolver> drawn_;  ///< for the places of the markers in the gel file
  std::vector<PlacedSolver> atRest_;           ///< for those in the zeros, from the one in use on
  Mailbox<traction::v1::MarkerStatus> markerStatus_;
  std::optional<control::GelWatch> gelWatch_;
  std::optional<track::CreepMemory> creep_;
  std::optional<calibrate::ZeroTracking> zeroTracking_;

  publish::TrackedFrame frame_;
  MarkerField markers_;
  TractionField field_;
  FieldGaps fieldGaps_;
  ReplaySolver solver_;
  std::optional<Id> zero_;  ///< in force
  RestPose taken_;
  bool isProposed_ = false;  ///< taken_ was asked for, and is not in force
  std::uint64_t number_ = 0, pictures_ = 0, gaps_ = 0;
  std::int64_t first_ns_ = 0;
  Clock::time_point begun_;
};

/// Ends the replay with an error; one without a place is about the recording.
void Replay::fail(Error error) const {
  if (error.where.empty()) error.where = options_.file;
  throw Stopped{std::move(error)};
}

void Replay::begin(std::string_view bytes) {
  if (beginning_) fail({.exitCode = EX_DATAERR, .what = "begins twice: several recordings in one are not replayed"});
  auto decoded = publish::decodeBeginning(bytes);
  if (!decoded) fail(decoded.error());
  beginning_ = *std::move(decoded);
}

/// Begins with the first picture: configuration, recording and picture must agree with each other.
void Replay::open(const Frame& first) {
  config_ = completed(config_, places_);
  config_.sensor.name = beginning_->message.sensor();
  if (!traction::isValidName(config_.sensor.name)) fail({.exitCode = EX_DATAERR, .what = "its sensor has no name"});
  runtime_.emplace(orStop(OwnDirectory::claim(places_.runtime, "runtime directory")));
  chooseSensor();
  checkPicture(first);
  if (beginning_->rest) require(*beginning_->rest);
  makeSolver(first);
  config_.publish.monotonicClock = monotonicOfRecording;
  config_.publish.realClock = realOfRecording;
  publisher_ = orStop(publish::Publisher::open(config_.publish, description_, ledger_, {}));
  if (!config_.record.file.empty()) openRecorder();
  makeTracker();
  creep_.emplace(sensor_.creep, sensor_.markerCount());
  zeroTracking_.emplace(sensor_, config_.track.followsDrift);
  if (beginning_->rest) {
    creep_->doubt();
    zeroTracking_->resume(beginning_->rest->taken_ns);
  }
  markers_ = blankMarkers(sensor_.markerCount());
  field_ = blankField(sensor_.markerCount(), sensor_.nodes.count());
  isOpen_ = true;
  first_ns_ = first.info.times.received_ns;
  begun_ = Clock::now();
  spdlog::info("replaying {}: sensor {}, stream {}", options_.file, config_.sensor.name,
               fmt::join(publisher_->streamEndpoints(), " "));
}

/// Takes sensor, tracking and solving from the recording, or from the configuration if it is asked for its own gel.
void Replay::chooseSensor() {
  if (options_.ownGel) {
    sensor_ = orStop(loadSensor(config_.sensor.gelFile));
  } else {
    auto recorded = parseRecordedConfig(beginning_->message.configuration(), options_.file);
    if (!recorded) {
      fail({.exitCode = EX_DATAERR,
            .what = "its configuration, of tractiond " + beginning_->message.software_version() +
                    ", is not understood: " + recorded.error().what,
            .remedy = "give one with --config"});
    }
    config_.track = recorded->track;
    config_.solve = recorded->solve;
    sensor_ = orStop(recordedSensor(*beginning_, options_.file, places_.runtime / "replayed.influence"));
  }
  description_.identity = {config_.sensor.name, publish::randomId(), solve::calibrationId(sensor_, config_.solve)};
  sameGel_ = publish::bytesOf(description_.identity.calibration) == beginning_->message.calibration();
  if (!sameGel_ && !options_.ownGel) {
    spdlog::warn(
        "warning: {} was recorded by tractiond {}, which computed with other numbers from the same gel file: the "
        "fields are not those of then",
        options_.file, beginning_->message.software_version());
  }
}

/// Ends the replay unless the picture is one of the sensor's camera.
void Replay::checkPicture(const Frame& picture) const {
  if (auto possible = track::trackable(sensor_, picture.format); !possible) fail(possible.error());
  const auto& recorded = beginning_->message;
  // Nothing is known of a film, or a camera without a number.
  const sensor::MeasuredWith with{.camera = recorded.camera_serial().empty()
                                                ? std::string()
                                                : sensor::cameraId(recorded.camera_vendor(), recorded.camera_serial()),
                                  .picture = ""};
  if (options_.ownGel && !sensor::MeasuredWith::parse(sensor_.measuredWith).holdsFor(with)) {
    fail(
        {.exitCode = EX_CONFIG,
         .what = fmt::format("is of camera {}, the gel file's was measured with {}", with.text(), sensor_.measuredWith),
         .remedy = "replay it with a gel file of its own sensor"});
  }
  if (picture.width == sensor_.camera.width && picture.height == sensor_.camera.height) return;
  fail({.exitCode = EX_CONFIG,
        .what = fmt::format("is of another sensor: its pictures are {} x {} pixels, the gel's {} x {}", picture.width,
                            picture.height, sensor_.camera.width, sensor_.camera.height),
        .remedy = "replay it with a gel file of its own sensor"});
}

/// Makes the solver, and completes the description by it.
void Replay::makeSolver(const Frame& first) {
  describeSensor(description_, sensor_, config_.solve);
  traction::v1::Description& message = description_.message;
  message.set_software_version(TRACTIOND_VERSION);
  message.set_host(publish::hostId());
  message.mutable_camera()->set_vendor(beginning_->message.camera_vendor());
  message.mutable_camera()->set_model(beginning_->message.camera_model());
  message.mutable_camera()->set_serial(beginning_->message.camera_serial());
  message.mutable_camera()->set_pixel_format(std::string(traitsOf(first.format).name));
  auto made = orStop(solve::makeSolver(sensor_, config_.solve, places_.state, {},
                                       [](const std::string& remark) { spdlog::warn("warning: {}", remark); }));
  drawn_ = std::move(made.solver);
  message.mutable_calibration()->set_time_ns(made.computed_ns);
  publish::encode(drawn_->detectionLimit_N(), *message.mutable_solver());
}

/// Begins a recording of the replay.
void Replay::openRecorder() {
  recorder_ = orStop(
      Recorder::open(config_.record, description_.identity, sensor_.markerCount(), sensor_.nodes.count(),
                     {.published = *publisher_, .monotonicClock = monotonicOfRecording, .realClock = realOfRecording}));
  publish::Beginning again = *beginning_;
  again.message.set_software_version(TRACTIOND_VERSION);
  again.message.set_calibration(publish::bytesOf(description_.identity.calibration));
  if (options_.ownGel) {
    Config used;
    used.track = config_.track;
    used.solve = config_.solve;
    used.camera.frameRate_Hz = config_.camera.frameRate_Hz;  // which solve.false_alarms_per_hour refers to
    again.message.set_configuration(configText(used));
    if (const auto read = readGelFiles(sensor_, config_.sensor.gelFile, again); !read) throw Stopped{read.error()};
  }
  recorder_->begin(again);
}

/// Makes the tracker, with the zero that was in force when the recording began.
void Replay::makeTracker() {
  track::TrackOptions tracking = config_.track;
  tracking.awaitsGelCheck = true;
  tracker_ = std::make_unique<track::Tracker>(sensor_, tracking);
  gelWatch_.emplace(sensor_, *tracker_, markerStatus_, nullptr);
  if (!beginning_->rest) return;
  tracker_->restore(*beginning_->rest);
  if (!sameGel_) gelWatch_->report(*beginning_->rest, gelWatch_->compare(*beginning_->rest));
  describe(*beginning_->rest);
}

/// Checks a zero of the recording.
void Replay::require(const RestPose& pose) const {
  if (pose.amplitude.size() != static_cast<std::size_t>(sensor_.markerCount())) {
    fail({.exitCode = EX_CONFIG,
          .what = fmt::format("is of another sensor: it has {} markers, the gel {}", pose.amplitude.size(),
                              sensor_.markerCount()),
          .remedy = "replay it with a gel file of its own sensor"});
  }
  if (!track::isSane(pose) || track::idOf(pose) != pose.id)
    fail({.exitCode = EX_DATAERR, .what = "a zero in it is damaged: its numbers make no sense"});
}

void Replay::describe(const RestPose& pose) {
  zero_ = pose.id;
  publish::encode(pose, *description_.message.mutable_zero());
  publisher_->describe(description_);
  if (!solve::followsRest(sensor_)) return;
  auto atRest = orStop(solve::makeSolverAtRest(sensor_, config_.solve, places_.state, pose.position_px, pose.present,
                                               drawn_->detectionLimit_N(),
                                               [](const std::string& remark) { spdlog::warn("warning: {}", remark); }));
  atRest_.push_back({std::move(atRest.solver), pose.id});
}

/// Returns the solver that the daemon used for a frame; where the recording does not state it, or the zeros are others
/// here, that of the newest zero.
PlacedSolver Replay::solverOf(const publish::TrackedFrame& frame) {
  auto one = atRest_.end();
  if (beginning_->statesPlaces() && sameGel_) {
    if (frame.places == Id{}) return {drawn_, {}};
    one = std::ranges::find(atRest_, frame.places, &PlacedSolver::zero);
  }
  if (one == atRest_.end() && !atRest_.empty()) one = atRest_.end() - 1;
  if (one == atRest_.end()) return {drawn_, {}};
  atRest_.erase(atRest_.begin(), one);
  return atRest_.front();
}

/// Returns whether zeros are compared with the gel file here. They are if the gel is another one, and after a gap, as
/// they are then averages of other frames than those that were compared at the time of the recording.
bool Replay::comparesZeros() const {
  return !sameGel_ || gaps_ > 0;
}

/// Returns whether the gel file fits the picture from which the zero was taken.
bool Replay::compare(const RestPose& zero) {
  const GelReport report = gelWatch_->compare(zero);
  gelWatch_->report(zero, report);
  if (const std::string doubt = report.doubt(); !doubt.empty()) spdlog::warn("warning: {}", doubt);
  return report.fits();
}

/// Repeats the recorded decisions on zeros, for the zeros that are taken here.
void Replay::handleZero(TrackerInputs& inputs) {
  if (isProposed_ && (beginning_->adoptsAtOnce() || (inputs.adopted && inputs.zero.taken_ns == taken_.taken_ns))) {
    taken_.requestedBy = inputs.adopted ? inputs.zero.requestedBy : "";
    inputs.adopted = true;
    inputs.zero = taken_;
  }
  if (inputs.adopted) {
    isProposed_ = false;
    inputs.comparedZero = inputs.zero.id;
    if (!comparesZeros() && !beginning_->adoptsAtOnce()) return;
    inputs.fits = compare(inputs.zero);
    inputs.compared = true;
    return;
  }
  const bool isKnown = inputs.comparedZero == zero_;
  if (!sameGel_ || (comparesZeros() && !isKnown)) inputs.compared = false;
}

/// Sleeps until the time of the picture, and serves subscribers meanwhile.
void Replay::pace(std::int64_t received_ns) {
  constexpr std::int64_t kLongest_ns = 3'600'000'000'000;  // times of a file may be anything
  std::chrono::nanoseconds after(0);
  if (options_.rate > 0.0) {
    const std::int64_t passed_ns = received_ns > first_ns_ ? std::min(received_ns - first_ns_, kLongest_ns) : 0;
    after = std::chrono::nanoseconds(static_cast<std::int64_t>(static_cast<double>(passed_ns) / options_.rate));
  }
  for (;;) {
    if (stopAsked != 0) throw Stopped{};
    const auto left = begun_ + after - Clock::now();
    if (options_.rate <= 0.0 || left <= 0ns) return publisher_->serve(-1, 0ms);
    publisher_->serve(-1, std::min(std::chrono::ceil<std::chrono::milliseconds>(left), 100ms));
  }
}

void Replay::picture(std::string_view bytes) {
  if (!beginning_) fail({.exitCode = EX_DATAERR, .what = "has pictures before it says of which sensor they are"});
  if (auto decoded = publish::decodePicture(bytes, frame_); !decoded) fail(decoded.error());
  Frame& frame = frame_.frame;
  recordedMonotonic.store(frame.info.times.received_ns, std::memory_order_relaxed);
  recordedReal.store(frame.info.times.receivedReal_ns, std::memory_order_relaxed);
  if (!isOpen_) open(frame);
  if (frame.width != sensor_.camera.width || frame.height != sensor_.camera.height ||
      traitsOf(frame.format).name != description_.message.camera().pixel_format())
    fail({.exitCode = EX_DATAERR, .what = "its pictures are not all of one size and format"});
  pace(frame.info.times.received_ns);
  ledger_.received.add();
  ++pictures_;
  if (frame_.number != number_ + 1) {  // pictures that were tracked but not recorded are missing in the tracker's state
    frame.info.discontinuity = true;
    ++gaps_;
  }
  number_ = frame_.number;
  TrackerInputs& inputs = frame_.inputs;
  if (inputs.adopted) require(inputs.zero);
  handleZero(inputs);
  tracker_->repeat(inputs);
  const bool tracked = tracker_->track(frame, markers_) == track::Outcome::kTracked;
  if (inputs.adopted) describe(inputs.zero);
  if (tracker_->takeRestPose(taken_)) {
    isProposed_ = zero_.has_value();
    if (!isProposed_) {
      if (comparesZeros()) compare(taken_);
      describe(taken_);
    }
  }
  const PlacedSolver placed = solverOf(frame_);
  if (recorder_) recorder_->takeFrame(frame, tracker_->inputs(), placed.zero);
  if (tracked) {
    zeroTracking_->takeOff(markers_);
    creep_->advance(markers_);
    zeroTracking_->watch(markers_);
    markers_.info.times.tracked_ns = frame.info.times.received_ns;  // no time passes
    solver_.solve(placed.solver, markers_, field_);
    field_.markers.info.times.solved_ns = frame.info.times.received_ns;
    fieldGaps_.mark(field_);
    publisher_->publish(field_);
    if (!field_.valid) ledger_.invalid.add();
    ledger_.published.add();
    if (recorder_) recorder_->takeField(field_);
  } else {
    ledger_.noRestPose.add();
  }
  if (recorder_) recorder_->turn(0ms);
}

tl::expected<void, Error> Replay::run() {
  const auto reader = recording::Reader::open(options_.file);
  if (!reader) return tl::unexpected(reader.error());
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, onSignal);
  std::optional<Error> error;
  tl::expected<recording::Extent, Error> extent;
  bool stopped = false;
  try {
    // First how the fields were solved: it stands behind the pictures.
    reader->read([&](const recording::Channel& channel, const recording::Schema*, const recording::Message& message) {
      if (stopAsked != 0) throw Stopped{};
      if (channel.topic.ends_with("/field/")) solver_.note(message.data);
    });
    extent = reader->read(
        [&](const recording::Channel& channel, const recording::Schema*, const recording::Message& message) {
          if (channel.topic == "beginning/") begin(message.data);
          if (channel.topic == "camera/") picture(message.data);
        });
    if (!extent) error = extent.error();
  } catch (Stopped& reason) {
    stopped = true;
    error = std::move(reason.error);
  }
  if (recorder_) {
    const auto closed = recorder_->close();
    if (!closed && !error) error = closed.error();
    if (closed) spdlog::info("recorded: {}", recorder_->account());
  }
  if (isOpen_) {
    spdlog::info("{}: {} pictures, {} fields in {:.1f} s", stopped ? "stopped" : "replayed", pictures_,
                 ledger_.published.get(), std::chrono::duration<double>(Clock::now() - begun_).count());
    if (gaps_ > 0)
      spdlog::warn(
          "warning: pictures are missing in the recording at {} places: fields behind them are not those of then",
          gaps_);
    if (sameGel_ && solver_.others() > 0)
      spdlog::warn("warning: {} fields are not those of then, as the pictures of their models are missing",
                   solver_.others());
  }
  if (error) return tl::unexpected(*error);
  if (stopped) return {};
  if (!extent->isWhole()) {
    return tl::unexpected(Error{.exitCode = EX_DATAERR,
                                .what = extent->trouble + "; what is whole was replayed",
                                .where = options_.file,
                                .remedy = "tractionctl recover makes a whole one of it"});
  }
  if (!isOpen_) {
    return tl::unexpected(Error{.exitCode = EX_DATAERR,
                                .what = "has no pictures from which fields could be computed",
                                .where = options_.file,
                                .remedy = "record with tractiond --record"});
  }
  return {};
}

}  // namespace

tl::expected<void, Error> replay(const Config& config, const Places& places, const ReplayOptions& options) {
  return Replay(config, places, options).run();
}

}  // namespace tractiond
