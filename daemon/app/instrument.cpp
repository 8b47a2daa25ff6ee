#include "daemon/app/instrument.h"

#include "daemon/app/gel_files.h"
#include "daemon/app/measurement.h"
#include "daemon/app/no_gel.h"
#include "daemon/capture/aravis_driver.h"
#include "daemon/capture/pipe_driver.h"
#include "daemon/solve/make_solver.h"
#include "traction/v1/status.pb.h"

#include <malloc.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace tractiond {
namespace {

/// Length of a turn while a step of a calibration looks at every frame.
constexpr std::chrono::milliseconds kHurriedTurn{3};

/// Returns the ledger as a sentence. Frames that were averaged for a zero are not lost, nor are those without a gel.
std::string account(const Ledger& ledger) {
  if (const std::uint64_t shown = ledger.noGel.get(); shown != 0) {
    return fmt::format("{} frames received, {} not measured as there is no gel, {} lost", ledger.received.get(), shown,
                       ledger.losses() - shown);
  }
  const std::uint64_t zero = ledger.noRestPose.get();
  return fmt::format("{} frames received, {} published, {} for the zero, {} lost", ledger.received.get(),
                     ledger.published.get(), zero, ledger.losses() - zero);
}

}  // namespace

Instrument::Instrument(Config config, OwnDirectory state, OwnDirectory runtime)
    : config_(std::move(config))
    , realtime_(std::make_shared<Realtime>(config_.realtime))
    , state_(std::move(state))
    , runtime_(std::move(runtime)) {}

Instrument::~Instrument() = default;

tl::expected<std::unique_ptr<Instrument>, Error> Instrument::make(const Config& config, const Places& places,
                                                                  std::shared_ptr<const Log> log) {
  auto state = OwnDirectory::claim(places.state, "state directory");
  if (!state) return tl::unexpected(state.error());
  Config complete = completed(config, places);
  if (const std::string aside = countStart(complete.sensor.adopted); !aside.empty()) {
    spdlog::error("{}", aside);
    complete = completed(config, places);
  }
  auto gel = loadGel(complete.sensor.gelFile);
  if (!gel) return tl::unexpected(gel.error());
  if (!*gel && !config.record.file.empty()) {
    return tl::unexpected(Error{.exitCode = EX_USAGE,
                                .what = "--record keeps what forces are computed from, and there is no gel",
                                .remedy = "name a gel file in sensor.gel_file, or start without --record"});
  }
  auto runtime = OwnDirectory::claim(places.runtime, "runtime directory");
  if (!runtime) return tl::unexpected(runtime.error());
  std::unique_ptr<Instrument> instrument(new Instrument(complete, *std::move(state), *std::move(runtime)));
  instrument->stateDirectory_ = places.state;
  instrument->log_ = std::move(log);
  if (auto built = instrument->build(*std::move(gel)); !built) return tl::unexpected(built.error());
  return instrument;
}

tl::expected<void, Error> Instrument::build(std::optional<sensor::Sensor> gel) {
  const Config& config = config_;
  description_.identity = {config.sensor.name, publish::randomId(),
                           gel ? solve::calibrationId(*gel, config.solve) : Id{}};
  description_.message.set_software_version(TRACTIOND_VERSION);
  description_.message.set_host(publish::hostId());
  if (gel) describeSensor(description_, *gel, config.solve);

  if (auto opened = openSockets(); !opened) return opened;
  if (auto processing = makeProcessing(std::move(gel)); !processing) return processing;
  if (config.preview.rate_Hz > 0.0) previewer_.emplace(*publisher_, config.preview);

  if (auto opened = openCamera(); !opened) return opened;
  PipelineOptions options = processing_->pipelineOptions();
  // Of a recording every picture counts; a camera's newest does.
  options.whenFull = config.camera.images.empty() ? WhenFull::kEvictOldest : WhenFull::kWait;
  options.controls = true;
  options.previews = previewer_.has_value();
  pipeline_ = std::make_unique<Pipeline>(*camera_, static_cast<Stages&>(*this), options, ledger_, turns_);
  return {};
}

tl::expected<void, Error> Instrument::openSockets() {
  const Config& config = config_;
  auto publisher =
      publish::Publisher::open(config.publish, description_, ledger_, [this](auto& status) { measure(status); });
  if (!publisher) return tl::unexpected(publisher.error());
  publisher_ = *std::move(publisher);
  // Its own one, as long as the control socket has none yet.
  if (const int sender = threadCalled("ZMQbg/IO/0"); sender != 0) realtime_->adopt(sender);
  auto server = control::ControlServer::open(config.controlEndpoints, *publisher_);
  if (!server) return tl::unexpected(server.error());
  controlServer_ = *std::move(server);
  return {};
}

tl::expected<void, Error> Instrument::makeProcessing(std::optional<sensor::Sensor> gel) {
  if (!gel) {
    spdlog::warn("warning: {}", NoGel::kWhy);
    processing_ = std::make_unique<NoGel>(*controlServer_);
    return {};
  }
  auto measurement = Measurement::make(*std::move(gel), {.config = config_,
                                                         .stateDirectory = stateDirectory_,
                                                         .ledger = ledger_,
                                                         .turns = turns_,
                                                         .description = description_,
                                                         .publisher = *publisher_,
                                                         .replies = *controlServer_,
                                                         .pipeline = pipeline_});
  if (!measurement) return tl::unexpected(measurement.error());
  processing_ = *std::move(measurement);
  return {};
}

/// Returns the driver by the configuration.
capture::OpenDriver Instrument::driver() const {
  const capture::CameraOptions& options = config_.camera;
  if (options.images.empty()) return capture::fromAravis(options, realtime_);
  return capture::fromPipe(options);
}

tl::expected<void, Error> Instrument::openCamera() {
  const capture::CameraOptions& options = config_.camera;
  const capture::Say say = [](capture::LogLevel level, const std::string& line) {
    if (level == capture::LogLevel::kWarning)
      spdlog::warn("warning: {}", line);
    else
      spdlog::info(line);
  };
  const bool piped = !options.images.empty();
  auto camera =
      capture::Camera::open(driver(),
                            {.wait = options.wait && !piped,
                             .silenceTimeout_ms = options.silenceTimeout_ms,
                             .buffers = options.buffers,
                             .stills = options.stills},
                            ledger_, say, [this](const auto& info) { return processing_->acceptCamera(info); });
  if (!camera) return tl::unexpected(camera.error());
  camera_ = *std::move(camera);
  return {};
}

tl::expected<void, Error> Instrument::start() {
  realtime_->lockMemory();
  if (auto started = pipeline_->start(); !started) return started;
  endTrial(config_.sensor.adopted);
  realtime_->report();
  const auto list = [](const std::vector<std::string>& endpoints) {
    return fmt::format("{}", fmt::join(endpoints, " "));
  };
  spdlog::info("running: sensor {}, stream {}, latest {}, control {}", config_.sensor.name,
               list(publisher_->streamEndpoints()), list(publisher_->latestEndpoints()),
               list(controlServer_->endpoints()));
  return {};
}

ServiceHooks Instrument::hooks() {
  return {.loops = loopsOf(turns_),
          // A film ends when its last picture is measured, which may wait for the zero's verdict and solver: requests
          // are answered and stop signals handled meanwhile.
          .ended = [this] { return pipeline_->ended() && (config_.camera.images.empty() || balanced(ledger_)); },
          .statusLine = [this] { return statusLine(); },
          .others = [this] { return !camera_->isForsaken(); },
          .startsAgain = [this] { return adoption_.isDue(); }};
}

void Instrument::takeOver(const tl::expected<Reread, Error>& read) {
  if (tractiond::takeOver(read, config_, description_.identity.calibration, camera_->refusedLast()))
    camera_->reopen(driver());
}

tl::expected<void, Error> Instrument::stop() {
  pipeline_->stop();
  auto recorded = processing_->finish();
  spdlog::info("stopped: {}", account(ledger_));
  if (!config_.camera.images.empty() && ledger_.noRestPose.get() > 0 && ledger_.published.get() == 0) {
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

bool Instrument::track(const Frame& frame, MarkerField& markers) {
  const bool tracked = processing_->track(frame, markers);
  if (previewer_) previewer_->takeFrame(frame, tracked ? &markers : nullptr);
  return tracked;
}

void Instrument::publish(const TractionField& field) {
  publisher_->publish(field);
  processing_->takeField(field);
}

void Instrument::control(std::chrono::milliseconds timeout) {
  controlServer_->serve(processing_->hurried() || cameraAsked_ ? std::min(timeout, kHurriedTurn) : timeout,
                        *processing_);
  meetCamera();
  if (const auto answer = cameraAsked_ ? camera_->takeAnswer() : std::nullopt) {
    cameraAsked_ = false;
    controlServer_->answerCamera(*answer);
  }
  if (const auto step = controlServer_->takeCameraStep()) {
    camera_->ask(*step);
    cameraAsked_ = true;
  }
  if (const auto gelFile = controlServer_->takeGelFile()) adopt(*gelFile);
  if (const auto kept = adoption_.turn()) controlServer_->answerAdoption(*kept);
  processing_->turn();
  giveMemoryBack(monotonicNow());
}

void Instrument::adopt(const std::string& gelFile) {
  const auto refuse = [this](std::string why) { controlServer_->answerAdoption(tl::unexpected(std::move(why))); };
  if (config_.sensor.adopted.empty()) {
    return refuse(
        "the configuration of this daemon names its gel file: set sensor.gel_file = \"adopted\", and restart it");
  }
  if (!config_.record.file.empty()) return refuse("a recording is made of what this gel file computes (--record)");
  const auto camera = camera_->info();
  if (!camera) return refuse("no camera has been seen yet");
  adoption_.begin(config_.sensor.adopted, gelFile, *camera);
}

/// Returns memory that is free, but not at the end of a heap, to the system: what waited for subscribers that have gone
/// lies between what is still used.
void Instrument::giveMemoryBack(std::int64_t now_ns) {
  constexpr std::int64_t kBetween_ns = 10'000'000'000;  // the threads that allocate wait meanwhile, for a millisecond
  constexpr std::size_t kWorthIt_bytes = 4 << 20;
  if (now_ns - trimmed_ns_ < kBetween_ns) return;
  trimmed_ns_ = now_ns;
  if (mallinfo2().fordblks > kWorthIt_bytes) malloc_trim(0);
}

/// Describes the camera for each session, as it may return with other values.
void Instrument::meetCamera() {
  const auto info = camera_->info();
  if (!info || info->session == describedSession_) return;
  describedSession_ = info->session;
  processing_->beginSession(*info);
  controlServer_->setCamera(measuredWith(*info));
  if (previewer_) previewer_->setFrameSize(info->shape.size);
  traction::v1::Camera& camera = *description_.message.mutable_camera();
  camera.set_vendor(info->name.vendor);
  camera.set_model(info->name.model);
  camera.set_serial(info->name.serial);
  camera.set_pixel_format(std::string(traitsOf(info->format).name));
  camera.set_width_px(static_cast<std::uint32_t>(info->shape.width));
  camera.set_height_px(static_cast<std::uint32_t>(info->shape.height));
  publisher_->describe(description_);
}

void Instrument::measure(traction::v1::Status& status) {
  if (camera_ && camera_->takeVitals(cameraVitals_)) {
    status.set_camera(static_cast<traction::v1::CameraState>(cameraVitals_.state));
    const bool wasOpen = cameraVitals_.state != CameraState::kUnknown && cameraVitals_.state != CameraState::kWaiting;
    wasOpen ? status.mutable_camera_link()->CopyFrom(cameraVitals_.link) : status.clear_camera_link();
  }
  // What a camera waits for matters while it sends nothing.
  const bool sends =
      cameraVitals_.state == CameraState::kStreaming && status.rates().received_hz() > 0.0 && !cameraVitals_.repeats;
  status.set_camera_why(sends ? std::string() : cameraVitals_.why);
  realtime_->read(*status.mutable_scheduling());
  traction::v1::Turns& turns = *status.mutable_turns();
  turns.set_capture(turns_.capture.get());
  turns.set_track(turns_.track.get());
  turns.set_solve(turns_.solve.get());
  turns.set_publish(turns_.publish.get());
  turns.set_control(turns_.control.get());
  status.set_log_lines_lost(log_ ? log_->lost() : 0);
  status.set_memory_bytes(memorySize("VmRSS:"));
  if (processing_) processing_->measure(status);
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
