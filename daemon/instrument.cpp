#include "daemon/instrument.h"

#include "daemon/base/apart.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/pipe_driver.h"
#include "daemon/solve/inverse_cache.h"
#include "daemon/track/nominal.h"
#include "daemon/track/rest_pose_file.h"
#include "sensor/gel_file.h"

#include <fcntl.h>
#include <pthread.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <future>
#include <iterator>
#include <thread>
#include <utility>

namespace tractiond {
namespace {

/// While somebody waits for a step of a calibration, every frame is looked at.
constexpr std::chrono::milliseconds kHurriedTurn{3};

/// Frames that made the zero were put to use: they are not among the lost.
std::string account(const Ledger& ledger) {
  const std::uint64_t zero = ledger.noRestPose.get();
  return fmt::format("{} frames received, {} published, {} for the zero, {} lost", ledger.received.get(),
                     ledger.published.get(), zero, ledger.losses() - zero);
}

/// Of a gel file, or of the influence file that it names.
Error asError(const sensor::FileError& error, const std::string& gelFile) {
  Error result{.exitCode = EX_CONFIG, .what = error.what, .where = error.where};
  if (error.isData) {
    result.exitCode = EX_DATAERR;
    result.remedy = "write it again, as docs/influence-file.md says";
  } else if (error.unreadable) {
    result.exitCode = EX_NOINPUT;
    result.remedy = error.where == gelFile ? "sensor.gel_file names it" : "gel.influence_file names it";
  }
  return result;
}

/// One line in ten per cent.
sensor::elastic::Progress progressLines() {
  return [last = -1](double done) mutable {
    const int tenth = static_cast<int>(done * 10);
    if (tenth == last) return;
    last = tenth;
    spdlog::info("a gel not seen before: computing its inverse, {} %", 10 * tenth);
  };
}

/// [bytes]; 0: there is no /proc. Allocates nothing.
std::uint64_t residentMemory() {
  const int file = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  std::array<char, 128> text{};  // all pages, those resident, ...
  const auto size = ::read(file, text.data(), text.size() - 1);
  ::close(file);
  char* behindAll = text.data();
  if (size > 0) std::strtoull(text.data(), &behindAll, 10);
  return std::strtoull(behindAll, nullptr, 10) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

tl::expected<sensor::Sensor, Error> loadSensor(const std::string& gelFile) {
  sensor::Sensor sensor;
  if (!gelFile.empty()) {
    auto loaded = sensor::loadGel(gelFile);
    if (!loaded) return tl::unexpected(asError(loaded.error(), gelFile));
    sensor = *std::move(loaded);
    if (auto same = calibrate::verifyCalibration(sensor, gelFile); !same) return tl::unexpected(same.error());
  }
  if (auto sound = track::trackable(sensor); !sound) return tl::unexpected(sound.error());
  return sensor;
}

void describeSensor(publish::Description& description, const sensor::Sensor& sensor, const solve::SolveOptions& solve) {
  description.sensor = sensor;
  description.mechanics = sensor.body                                     ? "influence file"
                          : solve.model == sensor::elastic::Model::kBlock ? "block"
                                                                          : "half-space";
  description.regularisation = "tikhonov";
  description.strength = solve.regularisation;
  description.contactAware = solve.contactAware;
  description.noise_px = solve.noise_px;
  description.forceScale_N = solve.forceScale_N;
}

void readGelFiles(const sensor::Sensor& sensor, const std::string& gelFile, publish::Beginning& beginning) {
  const auto content = [](const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    return file.empty() ? std::string() : std::string(std::istreambuf_iterator<char>(stream), {});
  };
  beginning.gel = content(gelFile);
  beginning.influence = sensor.body ? content(sensor.body->file) : "";
}

Instrument::Instrument(Config config, OwnDirectory state, OwnDirectory runtime)
    : config_(std::move(config))
    , realtime_(std::make_shared<Realtime>(config_.realtime))
    , state_(std::move(state))
    , runtime_(std::move(runtime)) {}

Instrument::~Instrument() = default;

tl::expected<std::unique_ptr<Instrument>, Error> Instrument::make(const Config& config, const Places& places,
                                                                  std::function<std::uint64_t()> logLinesLost) {
  auto sensor = loadSensor(config.sensor.gelFile);
  if (!sensor) return tl::unexpected(sensor.error());
  auto state = OwnDirectory::claim(places.state, "state directory");
  if (!state) return tl::unexpected(state.error());
  auto runtime = OwnDirectory::claim(places.runtime, "runtime directory");
  if (!runtime) return tl::unexpected(runtime.error());
  std::unique_ptr<Instrument> instrument(
      new Instrument(completed(config, places), *std::move(state), *std::move(runtime)));
  instrument->sensor_ = *std::move(sensor);
  instrument->stateDirectory_ = places.state;
  instrument->logLinesLost_ = std::move(logLinesLost);
  if (auto built = instrument->build(); !built) return tl::unexpected(built.error());
  return instrument;
}

tl::expected<void, Error> Instrument::build() {
  const Config& config = config_;
  description_.identity = {config.sensor.name, publish::randomId(), solve::inverseId(sensor_, config.solve)};
  description_.softwareVersion = TRACTIOND_VERSION;
  description_.host = publish::hostId();
  describeSensor(description_, sensor_, config.solve);

  auto publisher = publish::Publisher::open(config.publish, description_, ledger_, [this] { return vitals(); });
  if (!publisher) return tl::unexpected(publisher.error());
  publisher_ = *std::move(publisher);
  // Its own one, as long as the control socket has none yet.
  if (const int sender = threadCalled("ZMQbg/IO/0"); sender != 0) realtime_->adopt(sender);
  auto server = publish::ControlServer::open(config.controlEndpoints,
                                             {.status = [this] { return publisher_->lastStatus(); },
                                              .description = [this] { return publisher_->lastDescription(); },
                                              .zero = [this](const auto& request) { procedures_->beginZero(request); },
                                              .calibrate = [this](const auto& step) { procedures_->beginStep(step); },
                                              .camera =
                                                  [this](const auto& step) {
                                                    camera_->ask(step);
                                                    cameraAsked_ = true;
                                                  },
                                              .snapshot = [this] { gelWatch_->askSnapshot(); }});
  if (!server) return tl::unexpected(server.error());
  controlServer_ = *std::move(server);
  std::vector<std::string> bound;
  for (const auto* endpoints :
       {&publisher_->streamEndpoints(), &controlServer_->endpoints(), &publisher_->latestEndpoints()}) {
    bound.insert(bound.end(), endpoints->begin(), endpoints->end());
  }
  frozenPeers_.emplace(std::move(bound), [](const std::string& line) { spdlog::warn("warning: {}", line); });
  // The two sockets' contexts have a thread each behind them.
  for (const auto* endpoints : {&publisher_->streamEndpoints(), &controlServer_->endpoints()}) {
    if (!endpoints->empty()) greetings_.emplace_back(endpoints->front());
  }

  auto inverse = solve::loadOrCompute(sensor_, config.solve, stateDirectory_, progressLines(),
                                      [](const std::string& remark) { spdlog::warn("warning: {}", remark); });
  if (!inverse) return tl::unexpected(inverse.error());
  inverse_ = *std::move(inverse);
  description_.calibrated_ns = inverse_.computed_ns;
  publisher_->describe(description_);
  track::TrackOptions tracking = config.track;
  tracking.awaitJudge = true;  // nothing is measured from a zero that the gel file may not fit
  tracker_ = std::make_unique<track::Tracker>(sensor_, tracking);
  gelWatch_ = std::make_unique<GelWatch>(sensor_, *tracker_, newestMarkerStatus_, [this](const auto& result) {
    controlServer_->answerSnapshot(result, sensor_);
  });
  solver_ = std::make_unique<solve::Solver>(inverse_, sensor_, config.solve);
  description_.detectionLimit_N = solver_->detectionLimit_N();
  publisher_->describe(description_);
  makeProcedures();
  if (!config.record.file.empty()) {
    auto recorder = Recorder::open(config.record, description_.identity, sensor_.markerCount(), sensor_.nodes.count(),
                                   {.description = [this] { return publisher_->lastDescription(); }});
    if (!recorder) return tl::unexpected(recorder.error());
    recorder_ = *std::move(recorder);
  }
  if (config.preview.rate_Hz > 0.0) previewer_.emplace(*publisher_, config.preview);

  if (auto opened = openCamera(); !opened) return opened;
  pipeline_ = std::make_unique<Pipeline>(
      Stages{
          .source = *camera_,
          .track =
              [this, isFilm = !config.camera.images.empty()](const Frame& frame, MarkerField& markers) {
                if (isFilm) awaitFirstVerdict();
                const bool tracked = tracker_->track(frame, markers) == track::Outcome::kTracked;
                tracked_.add();
                gelWatch_->takeFrame(frame);
                if (previewer_) previewer_->takeFrame(frame, tracked ? &markers : nullptr);
                if (recorder_) recorder_->takeFrame(frame, tracker_->inputs());
                if (!tracked) return false;
                newestMarkers_.put(markers);  // while control takes one, this one is not seen there
                return true;
              },
          .solve = [this](const MarkerField& markers, TractionField& field) { solver_->solve(markers, field); },
          .publish =
              [this](const TractionField& field) {
                publisher_->publish(field);
                if (!field.valid) {
                  ledger_.invalid.add();
                  invalidFields_.add(field);
                }
                if (recorder_) recorder_->takeField(field);
              },
          .waitToPublish = [this](int fd, auto timeout) { publisher_->wait(fd, timeout); },
          .control = [this](auto timeout) { control(timeout); },
          .preview = previewer_ ? [this](auto timeout) { previewer_->turn(timeout); }
                                : std::function<void(std::chrono::milliseconds)>(),
          .record = recorder_ ? [this](auto timeout) { recorder_->turn(timeout); }
                              : std::function<void(std::chrono::milliseconds)>(),
          .enter = [this] { realtime_->enter(); },
      },
      PipelineOptions{.markers = sensor_.markerCount(),
                      .nodes = sensor_.nodes.count(),
                      // Of a recording every picture counts; a camera's newest does.
                      .whenFull = config.camera.images.empty() ? WhenFull::kEvictOldest : WhenFull::kWait},
      ledger_, turns_);
  return {};
}

/// By the configuration.
capture::OpenDriver Instrument::driver() const {
  const capture::CameraOptions& options = config_.camera;
  if (options.images.empty())
    return capture::fromAravis(options,
                               [realtime = realtime_](bool begins) { begins ? realtime->enter() : realtime->leave(); });
  return capture::fromPipe({.path = options.images,
                            .format = options.pixelFormat,
                            .width = options.width,
                            .height = options.height,
                            .buffers = options.buffers,
                            .frameRate_Hz = options.frameRate_Hz});
}

/// A film has time: how long the judgement of its zero takes must not decide how many of its pictures are measured.
void Instrument::awaitFirstVerdict() {
  while (tracker_->awaitsFirstVerdict() && !pipeline_->stopping())
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

tl::expected<void, Error> Instrument::openCamera() {
  const capture::CameraOptions& options = config_.camera;
  const capture::Say say = [](capture::Weight weight, const std::string& line) {
    if (weight == capture::Weight::kWarning)
      spdlog::warn("warning: {}", line);
    else
      spdlog::info(line);
  };
  const bool piped = !options.images.empty();
  auto camera = capture::Camera::open(
      driver(),
      {.wait = options.wait && !piped, .silenceTimeout_ms = options.silenceTimeout_ms, .buffers = options.buffers},
      ledger_, say, [this](const auto& info) { return welcome(info); });
  if (!camera) return tl::unexpected(camera.error());
  camera_ = *std::move(camera);
  return {};
}

tl::expected<void, Error> Instrument::welcome(const capture::CameraInfo& info) {
  const sensor::Camera& expected = sensor_.camera;
  if (info.shape.width != expected.width || info.shape.height != expected.height) {
    return tl::unexpected(
        Error{.exitCode = EX_CONFIG,
              .what = fmt::format("the camera's picture is {} x {} pixels, the gel's is {} x {}", info.shape.width,
                                  info.shape.height, expected.width, expected.height),
              .remedy = "set camera.width_px and camera.height_px, or describe the gel's camera"});
  }
  if (auto possible = track::trackable(sensor_, info.format); !possible) return possible;
  const std::string id = calibrate::cameraId(info.name.vendor, info.name.serial);
  if (sensor_.calibration && sensor_.calibration->camera != id) {
    return tl::unexpected(Error{
        .exitCode = EX_CONFIG,
        .what = fmt::format("the gel file was calibrated with camera {}, this is {}", sensor_.calibration->camera, id),
        .where = config_.sensor.gelFile,
        .remedy = "calibrate with this camera, starting from a gel file without calibration"});
  }
  if (info.session > 1) {  // the zero of the camera before is in force
    if (id == cameraId_) return {};
    return tl::unexpected(Error{.exitCode = EX_UNAVAILABLE,
                                .what = fmt::format("camera {} is not {}, whose zero is in force", id, cameraId_),
                                .remedy = "to use it, stop the daemon and set camera.id"});
  }
  cameraId_ = id;
  // A start that forgot the zero would call what presses now nothing.
  auto pose = track::loadRestPose(track::restPosePath(stateDirectory_), sensor_, info.format, id);
  if (!pose) return tl::unexpected(pose.error());
  restored_ = *std::move(pose);
  if (restored_) tracker_->restore(*restored_);
  earlier_ = earlierZero(info);
  if (recorder_) beginRecording(info);
  return {};
}

void Instrument::beginRecording(const capture::CameraInfo& info) {
  publish::Beginning beginning{.sensor = config_.sensor.name,
                               .softwareVersion = TRACTIOND_VERSION,
                               .calibration = description_.identity.calibration,
                               .configuration = configText(config_),
                               .gel = {},
                               .influence = {},
                               .rest = restored_,
                               .cameraVendor = info.name.vendor,
                               .cameraModel = info.name.model,
                               .cameraSerial = info.name.serial};
  readGelFiles(sensor_, config_.sensor.gelFile, beginning);
  recorder_->begin(beginning);
}

void Instrument::start() {
  realtime_->lockMemory();
  pipeline_->start();
  realtime_->report();
  const auto list = [](const std::vector<std::string>& endpoints) {
    return fmt::format("{}", fmt::join(endpoints, " "));
  };
  spdlog::info("running: sensor {}, stream {}, latest {}, control {}", config_.sensor.name,
               list(publisher_->streamEndpoints()), list(publisher_->latestEndpoints()),
               list(controlServer_->endpoints()));
}

ServiceHooks Instrument::hooks() {
  return {.loops = loopsOf(turns_),
          .ended = [this] { return pipeline_->ended(); },
          .statusLine = [this] { return statusLine(); },
          .others = [this] {  // each greeting is called: that also makes the next connection
            const bool greeted = std::ranges::count_if(greetings_, &publish::Greeting::came) == std::ssize(greetings_);
            return greeted && !camera_->isForsaken();
          }};
}

tl::expected<std::vector<std::string>, Error> Instrument::reload(const Config& completed) {
  const auto gel = loadSensor(completed.sensor.gelFile);
  if (!gel) return tl::unexpected(gel.error());
  const bool piped = !config_.camera.images.empty();
  std::vector<std::string> news, bound;
  bool ofCamera = false;
  for (const Change& change : changesBetween(config_, completed)) {
    const bool camera = change.key.starts_with("camera.");
    ofCamera = ofCamera || camera;
    if (change.live && !(camera && piped))
      news.push_back(fmt::format("{} = {} (was {})", change.key, change.after.empty() ? "none" : change.after,
                                 change.before.empty() ? "none" : change.before));
    else
      bound.push_back(change.key);
  }
  if (bound.empty() && solve::inverseId(*gel, config_.solve) != description_.identity.calibration)
    bound.emplace_back("what sensor.gel_file holds");
  if (!bound.empty()) {
    return tl::unexpected(Error{.exitCode = EX_CONFIG,
                                .what = fmt::format("not while it runs: {}", fmt::join(bound, ", ")),
                                .remedy = "restart the service"});
  }
  if (!ofCamera && camera_->refusedLast()) {
    ofCamera = true;
    news.emplace_back("what the camera refused, once more");
  }
  config_.logLevel = completed.logLevel;
  spdlog::set_level(spdlog::level::from_str(completed.logLevel));
  if (ofCamera) {
    config_.camera = completed.camera;
    camera_->reopen(driver());
  }
  return news;
}

tl::expected<void, Error> Instrument::stop() {
  pipeline_->stop();
  const auto recorded = recorder_ ? recorder_->close() : tl::expected<void, Error>();
  if (recorder_ && recorded) spdlog::info("recorded: {}", recorder_->account());
  spdlog::info("stopped: {}", account(ledger_));
  if (!config_.camera.images.empty() && ledger_.received.get() > 0 && ledger_.published.get() == 0) {
    spdlog::warn(
        "warning: no field was published: the pictures ended before there was a zero, which is averaged over {} "
        "of them (track.zero_frames), with the gel untouched",
        config_.track.zeroFrames);
  }
  if (pipeline_->ended() && camera_->error().exitCode != EX_OK) return tl::unexpected(camera_->error());
  if (!balanced(ledger_)) {
    return tl::unexpected(Error{.exitCode = EX_SOFTWARE,
                                .what = "the ledger does not balance: " + account(ledger_),
                                .remedy = "this is a bug: please report it"});
  }
  return recorded;
}

void Instrument::control(std::chrono::milliseconds timeout) {
  controlServer_->serve(procedures_->hurried() || gelWatch_->hurried() || cameraAsked_ ? std::min(timeout, kHurriedTurn)
                                                                                       : timeout);
  meetCamera();
  if (cameraAsked_) {
    if (const auto answer = camera_->takeAnswer()) {
      cameraAsked_ = false;
      controlServer_->answerCamera(*answer);
    }
  }
  procedures_->turn();
  gelWatch_->turn();
  const std::int64_t now_ns = monotonicNow();
  frozenPeers_->look(now_ns);
  if (const std::string line = inflow_.look(now_ns); !line.empty()) spdlog::warn("warning: {}", line);
}

/// Each session anew: it may have come back with other values.
void Instrument::meetCamera() {
  const auto info = camera_->info();
  if (!info || info->session == describedSession_) return;
  const bool first = std::exchange(describedSession_, info->session) == 0;
  if (first) {
    if (restored_) {
      spdlog::info("the zero is the one kept in {}", stateDirectory_.string());
    } else {
      spdlog::info("no zero is kept: the first {} still frames are taken for it", config_.track.zeroFrames);
    }
    procedures_->welcome(cameraId_, info->frameRate_Hz, restored_, earlier_);
  }
  describeCamera(*info);
}

/// It only serves to undo: where it is of no use, it is as if it were not there.
std::optional<RestPose> Instrument::earlierZero(const capture::CameraInfo& info) const {
  const auto pose = track::loadRestPose(track::earlierPosePath(stateDirectory_), sensor_, info.format, cameraId_);
  if (!pose) spdlog::warn("warning: the zero cannot be undone: {}", pose.error().message());
  return pose.value_or(std::nullopt);
}

void Instrument::describeCamera(const capture::CameraInfo& info) {
  description_.cameraVendor = info.name.vendor;
  description_.cameraModel = info.name.model;
  description_.cameraSerial = info.name.serial;
  description_.pixelFormat = traitsOf(info.format).name;
  publisher_->describe(description_);
}

void Instrument::makeProcedures() {
  procedures_ = std::make_unique<Procedures>(
      sensor_,
      ProcedureOptions{.zeroFrames = config_.track.zeroFrames,
                       .directory = stateDirectory_,
                       .progress = [this](double) { turns_.control.add(); }},
      ProcedureLinks{
          .frames = tracked_,
          .markers = newestMarkers_,
          .watched = watched_,
          .requestZero = [this] { tracker_->requestZero(); },
          .cancelZero = [this] { return tracker_->cancelZero(); },
          .zeroState = [this] { return tracker_->zeroState(); },
          .takeRestPose = [this](RestPose& pose) { return tracker_->takeRestPose(pose); },
          .putInForce = [this](const RestPose& pose) { return tracker_->putInForce(pose, gelWatch_->fits()); },
          .judge = [this](const RestPose& pose) { return gelWatch_->judge(pose); },
          .describe =
              [this](const RestPose& pose) {
                description_.zero = pose;
                publisher_->describe(description_);
              },
          .keep =
              [this](const RestPose& pose, const RestPose* before) {
                const auto save = [this, format = camera_->info()->format](const std::filesystem::path& path,
                                                                           const RestPose& one) {
                  return track::saveRestPose(path, one, sensor_, format, cameraId_);
                };
                // Never on a thread that a watchdog looks after: a disk may take seconds for each of its calls.
                return std::async(std::launch::async,
                                  [this, save, pose, earlier = before ? std::optional(*before) : std::nullopt]() {
                                    pthread_setname_np(pthread_self(), "tr-keep");
                                    if (earlier) {
                                      auto saved = save(track::earlierPosePath(stateDirectory_), *earlier);
                                      if (!saved) return saved;
                                    }
                                    return save(track::restPosePath(stateDirectory_), pose);
                                  });
              },
          .slowly = [this](const auto& work) { apart(turns_.control, work); },
          .answerZero = [this](const auto& result,
                               const std::string& remark) { controlServer_->answerZero(result, remark); },
          .answerCalibration = [this](const auto& result) { controlServer_->answerCalibration(result); },
      });
}

publish::Vitals Instrument::vitals() {
  watched_.take(lastWatched_);
  newestMarkerStatus_.take(markerStatus_);
  if (camera_) camera_->takeVitals(cameraVitals_);
  realtime_->read(scheduling_);  // else those of before
  publish::FixedText<300> invalidWhy;
  invalidWhy.assign(invalidFields_.take());
  return {.camera = cameraVitals_,
          .turns = {turns_.capture.get(), turns_.track.get(), turns_.solve.get(), turns_.publish.get(),
                    turns_.control.get()},
          .drift = lastWatched_.drift,
          .markers = markerStatus_,
          .zeroWithin_s = lastWatched_.zeroWithin_s,
          .invalidWhy = invalidWhy,
          .logLinesLost = logLinesLost_ ? logLinesLost_() : 0,
          .memory_bytes = residentMemory(),
          .scheduling = scheduling_};
}

std::string Instrument::statusLine() const {
  const char* camera = "";
  switch (camera_->state()) {
  case CameraState::kUnknown:
  case CameraState::kWaiting:
    camera = "waiting for a camera";
    break;
  case CameraState::kConnecting:
    camera = "setting the camera up";
    break;
  case CameraState::kStreaming:
    camera = "streaming";
    break;
  case CameraState::kLost:
    camera = "camera lost, looking for it";
    break;
  }
  return fmt::format("{}; {}", camera, account(ledger_));
}

}  // namespace tractiond
