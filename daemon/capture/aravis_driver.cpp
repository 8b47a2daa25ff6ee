// Strategy. Found, controlled, set, read back, streaming, its packet size proved by a whole frame: then it is open.
//
// A picture that is used is proved whole. The kernel's filter passes a data packet only if it fills its block as far as
// the picture reaches, so that a frame with holes stays incomplete (stream_filter.h); what the leader says is compared
// with what was agreed upon, for each frame (sent_picture.h). If no frame becomes whole, the stream's socket is read
// without Aravis for one frame (surveyStream()). That shows what the filter keeps from Aravis: the length of the
// packets, which the stream is then opened for, or what the camera sends instead of pictures.
#include "daemon/capture/aravis_driver.h"

#include "base/clock.h"
#include "daemon/capture/aravis.h"
#include "daemon/capture/camera_list.h"
#include "daemon/capture/chunk_description.h"
#include "daemon/capture/gvcp_search.h"
#include "daemon/capture/sent_picture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;

class AravisDriver : public Driver {
 public:
  static tl::expected<std::unique_ptr<Driver>, Error> open(const CameraOptions& options, const Opening& opening,
                                                           std::shared_ptr<ThreadWatch> watch,
                                                           std::shared_ptr<std::atomic<bool>> isDoubted);
  ~AravisDriver() override;

  const CameraInfo& info() const override { return info_; }
  Popped pop(Buffer& buffer, milliseconds timeout) override;
  void giveBack(void* handle) override { arv_stream_push_buffer(stream_.get(), static_cast<ArvBuffer*>(handle)); }
  bool takeClock(ClockFit& fit) override { return clock_ && clock_->take(fit); }
  Discard discard() const override {
    return [](void* handle) { g_object_unref(handle); };
  }
  std::string doubt() override;
  std::string objection() const override;
  void markSilent() override { silent_ = true; }
  void undo() override;
  CameraLink link(const CameraLink& before) override {
    CameraLink link = readLink(camera_.get(), stream_.get(), guard_, before, {&silent_, &controlLost_});
    if (link.has_temperature()) temperature_C_ = static_cast<float>(link.temperature());
    return link;
  }
  tl::expected<CameraReport, std::string> serve(const CameraStep& step) override {
    return serveFeatures(camera_.get(), step, options_.features, first_);
  }

 private:
  /// What came of a stream that was started. kUnfit: whole frames, none with the agreed picture.
  enum class Proof { kWhole, kUnfit, kBroken, kNothing };
  static constexpr milliseconds kAnswer{130};
  /// From these is judged what the camera sends: the first may be what was left of other settings.
  static constexpr int kFirstFrames = 3;

  static void onStream(void* driver, ArvStreamCallbackType type, ArvBuffer*);
  tl::expected<void, Error> setUp(const CameraOptions& wanted, const CameraInfo* before);
  tl::expected<void, Error> start();
  tl::expected<Proof, Error> tryStream(int packetSize_bytes);
  tl::expected<bool, Error> adaptStream(int asked_bytes);
  tl::expected<void, Error> startStream(int packetSize_bytes, int filled_bytes);
  StreamShape shapeOfStream() const;
  double patience_s() const;
  Proof awaitWholeFrame();
  void describe(ArvBuffer* from, Buffer& buffer);
  void account(Arrival& arrival);

  CameraOptions options_;
  std::atomic<float> temperature_C_{std::numeric_limits<float>::quiet_NaN()};  // from link() to pop()
  std::atomic<bool> controlLost_{false};  // set by Aravis's heartbeat thread: outlives the camera
  std::atomic<bool> silent_{false};
  std::shared_ptr<ThreadWatch> watch_;
  /// Shared with the next opening: frames came that were not whole, and this one had seen none.
  std::shared_ptr<std::atomic<bool>> isDoubted_;
  ControlGuard guard_;  // before the camera
  Ref<ArvCamera> camera_;
  Ref<ArvStream> stream_;
  std::unique_ptr<AskedClock> clock_;  ///< none: it cannot be asked
  CameraInfo info_;
  std::size_t payload_ = 0;  ///< bytes of a buffer
  std::uint64_t framePackets_ = 0;
  struct Packets {
    std::int64_t ignored = 0, twice = 0;
  } packets_;                                  ///< when they were counted last
  bool portIsTrue_ = true;                     ///< the camera sends from the port that it names
  bool answersSearch_ = false;                 ///< as it did when it was opened: see doubt()
  bool isSeen_ = false;                        ///< a frame was whole, or its packets were read by surveyStream()
  bool isPatient_ = false;                     ///< waits for a frame of a camera that waits for its trigger
  int broken_ = 0;                             ///< frames that were not whole before the first that was
  std::optional<bool> extendedIds_;            ///< as its packets show; none: as the camera says
  std::optional<std::pair<int, int>> offset_;  ///< of its pictures, by the first leader
  SentPicture unfit_;                          ///< the last frame that was whole and had another picture
  ChunkDescription chunks_;
  std::vector<Feature> undo_;                 ///< features as they were before it was set up
  std::map<std::string, std::string> first_;  ///< features as they were before people wrote them
};

AravisDriver::~AravisDriver() {
  clock_.reset();
  if (stream_ && !silent_ && !controlLost_) arv_camera_stop_acquisition(camera_.get(), nullptr);
  // A stream waits for its thread. Should that hang, the camera is free for the next driver all the same.
  if (silent_ && framePackets_ != 0)
    arv_gv_device_leave_control(ARV_GV_DEVICE(arv_camera_get_device(camera_.get())), nullptr);
  stream_.reset();
  camera_.reset();
}

/// Returns what Aravis opens the camera of the session before by, as soon as it answers: at its address, or, at every
/// second try, at a new one. Empty: it does not answer within a second, or a stop was requested.
std::string locate(const CameraName& camera, const Opening& opening, bool withFake) {
  constexpr milliseconds kAnswer{100};
  constexpr int kTries = 10;
  if (!camera.address.empty() && opening.attempt % 2 == 0) {
    for (int i = 0; i < kTries && !opening.stop.stop_requested(); ++i)
      if (answersSearch(camera.address, kAnswer)) return camera.address;
    return {};
  }
  for (const CameraName& one : listCameras(withFake))
    if (one.serial == camera.serial) return handleOf(one);
  return {};
}

tl::expected<std::unique_ptr<Driver>, Error> AravisDriver::open(const CameraOptions& options, const Opening& opening,
                                                                std::shared_ptr<ThreadWatch> watch,
                                                                std::shared_ptr<std::atomic<bool>> isDoubted) {
  auto driver = std::make_unique<AravisDriver>();
  driver->options_ = options;
  driver->watch_ = std::move(watch);
  driver->isDoubted_ = std::move(isDoubted);
  CameraOptions& wanted = driver->options_;
  const CameraInfo* before = opening.before;
  if (before != nullptr) {
    // As it was, should it come back with its defaults.
    wanted.width = before->shape.width;
    wanted.height = before->shape.height;
    wanted.pixelFormat = traitsOf(before->format).name;
    wanted.id = locate(before->name, opening, options.fakeInterface);
    if (wanted.id.empty())
      return failed(EX_UNAVAILABLE, "camera " + before->name.id + " does not answer", before->name.address);
  }
  auto connected = connectCamera(wanted, opening, driver->guard_);
  if (!connected) return tl::unexpected(connected.error());
  if (opening.found) opening.found();
  driver->camera_ = *std::move(connected);
  ArvCamera* camera = driver->camera_.get();
  CameraInfo& info = driver->info_;
  info.name = nameOf(camera);
  if (before != nullptr && (info.name.vendor != before->name.vendor || info.name.serial != before->name.serial))
    return failed(EX_UNAVAILABLE, "another camera answers, " + info.name.id);
  driver->answersSearch_ = !info.name.address.empty() && answersSearch(info.name.address, milliseconds(1000));
  g_signal_connect(arv_camera_get_device(camera), "control-lost",
                   G_CALLBACK(+[](ArvDevice*, std::atomic<bool>* lost) { lost->store(true); }), &driver->controlLost_);

  if (auto done = driver->setUp(wanted, before); !done) {
    if (done.error().exitCode != EX_UNAVAILABLE) driver->undo();
    return tl::unexpected(done.error());
  }
  driver->clock_ = AskedClock::open(arv_camera_get_device(camera));
  return driver;
}

tl::expected<void, Error> AravisDriver::setUp(const CameraOptions& wanted, const CameraInfo* before) {
  ArvCamera* camera = camera_.get();
  if (auto set = applySettings(camera, wanted, before == nullptr ? nullptr : &before->standing, info_, undo_); !set)
    return set;
  if (auto read = readPicture(camera, info_); !read) return read;
  chunks_ = describeChunks(arv_camera_get_device(camera));
  return start();
}

/// A camera that sends pictures locks what shapes them.
void AravisDriver::undo() {
  clock_.reset();
  if (stream_) arv_camera_stop_acquisition(camera_.get(), nullptr);
  stream_.reset();
  for (; !undo_.empty(); undo_.pop_back())
    std::ignore = writeFeature(arv_camera_get_device(camera_.get()), undo_.back());
}

tl::expected<void, Error> AravisDriver::start() {
  ArvCamera* camera = camera_.get();
  // Read before: Aravis remembers a value that was refused as if it stood.
  const std::string mode = readFeature(arv_camera_get_device(camera), "AcquisitionMode");
  Failure refusal;  // a camera without modes refuses as well
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, refusal.into());
  if (refusal && (mode == "SingleFrame" || mode == "MultiFrame"))
    return failed(refusal.exitCode(),
                  "the camera refuses AcquisitionMode = Continuous, and sends a picture or some with " + mode + ": " +
                      refusal.text(),
                  "its user set may lock it: load another with camera.features, or set the mode with the maker's tool");
  info_.zeroIsAnId = !arv_camera_is_gv_device(camera);
  if (!arv_camera_is_gv_device(camera)) {
    if (arv_camera_is_uv_device(camera)) {
      arv_camera_uv_set_usb_mode(camera, ARV_UV_USB_MODE_ASYNC);
      const std::string warning = usbMemoryWarning(info_.shape.size * static_cast<std::size_t>(options_.buffers));
      if (!warning.empty()) info_.warnings.push_back(warning);
    }
    isSeen_ = true;  // its packets have no size that could be wrong
    return startStream(0, 0);
  }

  if (std::string shared = ambiguity(info_.name.address); !shared.empty()) info_.warnings.push_back(std::move(shared));
  // It would pass by the filter.
  arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);

  const auto sizes = packetSizes(camera, options_);
  if (!sizes) return tl::unexpected(sizes.error());
  portIsTrue_ = !info_.triggered;  // of a camera that waits, nothing comes to prove it
  isPatient_ = isDoubted_->exchange(false);
  Proof proof = Proof::kBroken;
  for (const int size : *sizes) {
    const auto tried = tryStream(size);
    if (!tried) return tl::unexpected(tried.error());
    proof = *tried;
    if (proof != Proof::kBroken) break;
  }
  info_.packetSizeVerified = proof == Proof::kWhole;
  if (proof == Proof::kBroken)
    info_.warnings.push_back("no whole frame has arrived yet, not even with packets of " +
                             std::to_string(info_.packetSize_bytes) + " bytes: the network loses packets");
  if (info_.receiveBuffer_bytes < options_.receiveBuffer_bytes)
    info_.warnings.push_back("the kernel grants a receive buffer of " + std::to_string(info_.receiveBuffer_bytes) +
                             " bytes instead of " + std::to_string(options_.receiveBuffer_bytes) +
                             "; sysctl -w net.core.rmem_max=" + std::to_string(options_.receiveBuffer_bytes));
  return {};
}

/// Starts the stream with packets of this size, and again if that shows that the camera sends others. Fails with
/// EX_CONFIG if what it sends are not the pictures agreed upon.
tl::expected<AravisDriver::Proof, Error> AravisDriver::tryStream(int packetSize_bytes) {
  if (auto started = startStream(packetSize_bytes, packetSize_bytes); !started) return tl::unexpected(started.error());
  Proof proof = awaitWholeFrame();
  const bool isSilent = proof == Proof::kNothing && packetsRefused(stream_.get()) == 0;
  if (proof != Proof::kUnfit && proof != Proof::kWhole && !isSilent) {
    const auto adapted = adaptStream(packetSize_bytes);
    if (!adapted) return tl::unexpected(adapted.error());
    if (*adapted) proof = awaitWholeFrame();
  }
  if (proof == Proof::kUnfit) return failed(EX_CONFIG, "the camera " + objection(), remedyOf(unfit_.payloadType));
  return proof;
}

/// Starts the stream again if packets of it show that it must be opened in another way. Returns whether they do.
tl::expected<bool, Error> AravisDriver::adaptStream(int asked_bytes) {
  const auto patience = std::chrono::ceil<milliseconds>(std::chrono::duration<double>(patience_s() / 2));
  const StreamShape shape = shapeOfStream();
  const auto surveyed = surveyStream(stream_.get(), shape, patience);
  if (!surveyed) return tl::unexpected(surveyed.error());
  const PacketSurvey& survey = *surveyed;
  if (!survey.hasLeader()) return false;
  isSeen_ = true;
  isPatient_ = false;
  SentPicture sent = survey.picture();
  // How much comes is known of whole frames alone.
  sent.size = sent.payloadType == SentPicture::kChunks ? info_.shape.size : std::numeric_limits<std::size_t>::max();
  if (const std::string why = deviation(sent, info_.shape); !why.empty())
    return failed(EX_CONFIG, "the camera " + why, remedyOf(sent.payloadType));
  const std::size_t block_bytes =
      survey.block_bytes() == 0 ? static_cast<std::size_t>(shape.blockBytes()) : survey.block_bytes();
  StreamShape other = shape;
  other.extendedIds = survey.extendedIds();
  const int filled_bytes = StreamShape::kNetworkHeaders_bytes + other.headerBytes() + static_cast<int>(block_bytes);
  const bool isElsewhere = portIsTrue_ && shape.cameraPort != 0 && survey.port() != shape.cameraPort;
  if (!isElsewhere && other.extendedIds == shape.extendedIds && filled_bytes == info_.packetSize_bytes) return false;
  if (isElsewhere) {
    portIsTrue_ = false;
    info_.warnings.push_back("the camera does not send from the port that it says it does (GevSCSP); packets from any "
                             "port of its address are taken");
  }
  extendedIds_ = other.extendedIds;
  if (auto started = startStream(asked_bytes, filled_bytes); !started) return tl::unexpected(started.error());
  return true;
}

StreamShape AravisDriver::shapeOfStream() const {
  StreamShape shape = streamShape(camera_.get(), info_.packetSize_bytes, payload_, info_.shape.size);
  if (!portIsTrue_) shape.cameraPort = 0;
  if (extendedIds_) shape.extendedIds = *extendedIds_;
  return shape;
}

/// Starts the stream. Aravis takes the size of a block from the register when the stream is created; a camera that
/// sends less than it is asked for is asked for as much as before, so that it does not send still less.
/// \param packetSize_bytes to ask for; 0: not a network camera
/// \param filled_bytes size of the packets that come then
tl::expected<void, Error> AravisDriver::startStream(int packetSize_bytes, int filled_bytes) {
  ArvCamera* camera = camera_.get();
  if (stream_) arv_camera_stop_acquisition(camera, nullptr);
  stream_.reset();
  Failure failure;
  if (packetSize_bytes > 0) {
    arv_camera_gv_set_packet_size(camera, filled_bytes, failure.into());
    if (!failure) info_.packetSize_bytes = static_cast<int>(arv_camera_gv_get_packet_size(camera, failure.into()));
    if (failure)
      return failed(failure.exitCode(), "the camera refuses packets of " + std::to_string(filled_bytes) + " bytes",
                    failure.text());
    if (filled_bytes != packetSize_bytes && info_.packetSize_bytes != filled_bytes)
      return failed(EX_CONFIG,
                    "the camera is asked for packets of " + std::to_string(packetSize_bytes) + " bytes, sends " +
                        std::to_string(filled_bytes) + ", and allows " + std::to_string(info_.packetSize_bytes) +
                        " instead",
                    "set camera.packet_size_bytes to a size that it fills");
  }
  stream_.reset(aravis::createStream(camera, onStream, this, failure.into()));
  if (!stream_) return failed(EX_UNAVAILABLE, "the camera's stream cannot be opened", failure.text());
  const guint payload = arv_camera_get_payload(camera, failure.into());
  constexpr guint kMost = 1U << 30;
  if (failure || payload < info_.shape.size || payload > kMost)
    return failed(EX_UNAVAILABLE,
                  "the camera announces " + std::to_string(payload) + " bytes for a picture of " +
                      std::to_string(info_.shape.size),
                  failure ? failure.text() : "");
  payload_ = payload;
  if (ARV_IS_GV_STREAM(stream_.get())) {
    if (filled_bytes != packetSize_bytes) {
      info_.settings.push_back("packets of " + std::to_string(packetSize_bytes) + " bytes are asked for, it sends " +
                               std::to_string(filled_bytes));
      arv_camera_gv_set_packet_size(camera, packetSize_bytes, failure.into());
    }
    if (failure)
      return failed(failure.exitCode(), "the camera refuses packets of " + std::to_string(packetSize_bytes) + " bytes",
                    failure.text());
    const StreamShape shape = shapeOfStream();
    framePackets_ = shape.blocks() + 2;  // with leader and trailer
    if (auto guarded = guardStream(stream_.get(), shape); !guarded) return guarded;
    // Of a frame whose camera pauses for longer than packet-timeout Aravis asks for all that is still to come, and by
    // default, a quarter of its packets, then never again for what is really lost.
    constexpr double kMostRequests = 2.0;  // of a frame's packets; Aravis allows no more
    g_object_set(stream_.get(), "packet-timeout", static_cast<guint>(options_.packetTimeout_us), "frame-retention",
                 static_cast<guint>(options_.frameRetention_us), "packet-request-ratio", kMostRequests, nullptr);
    info_.receiveBuffer_bytes = setReceiveBuffer(stream_.get(), options_.receiveBuffer_bytes);
  }
  for (int i = 0; i < options_.buffers; ++i) {
    ArvBuffer* buffer = arv_buffer_new(payload, nullptr);
    std::size_t unused = 0;
    // Touched now, no page is faulted in later.
    std::memset(const_cast<void*>(arv_buffer_get_data(buffer, &unused)), 0, payload);
    arv_stream_push_buffer(stream_.get(), buffer);
  }
  arv_camera_start_acquisition(camera, failure.into());
  if (failure) return failed(EX_UNAVAILABLE, "the camera does not start", failure.text());
  return {};
}

/// In Aravis's thread, which ends before the stream that this driver holds.
void AravisDriver::onStream(void* driver, ArvStreamCallbackType type, ArvBuffer* /*buffer*/) {
  auto& self = *static_cast<AravisDriver*>(driver);
  if (!self.watch_) return;
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT) self.watch_->enter();
  if (type == ARV_STREAM_CALLBACK_TYPE_EXIT) self.watch_->leave();
}

/// Four frames, should they be slow; of a camera that waits for its trigger nothing comes.
double AravisDriver::patience_s() const {
  if (isPatient_) return 5.0;
  return info_.triggered ? 0.1 : std::clamp(info_.frameRate_Hz > 0 ? 4.0 / info_.frameRate_Hz : 1.0, 1.0, 5.0);
}

AravisDriver::Proof AravisDriver::awaitWholeFrame() {
  const std::int64_t until_ns = monotonicNow() + std::llround(patience_s() * 1e9);
  int broken = 0, unfit = 0;
  while (broken + unfit < kFirstFrames) {
    const std::int64_t left_ns = until_ns - monotonicNow();
    ArvBuffer* popped =
        left_ns <= 0 ? nullptr : arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(left_ns / 1000));
    if (popped == nullptr) break;
    Buffer buffer;
    describe(popped, buffer);
    arv_stream_push_buffer(stream_.get(), popped);
    if (buffer.data != nullptr) return Proof::kWhole;
    ++(buffer.arrival.complete ? unfit : broken);
  }
  if (unfit == kFirstFrames) return Proof::kUnfit;
  return broken > 0 ? Proof::kBroken : Proof::kNothing;
}

/// An answer may be late where packets are not: one thread of a camera may do both.
std::string AravisDriver::doubt() {
  const auto received = [this] {
    return framePackets_ == 0 ? 0 : arv_stream_get_info_uint64_by_name(stream_.get(), "n_received_packets");
  };
  const std::uint64_t before = received();
  if (!answersSearch_ || answersSearch(info_.name.address, kAnswer)) return "";
  return received() != before ? "" : "it does not answer";
}

Popped AravisDriver::pop(Buffer& buffer, milliseconds timeout) {
  if (controlLost_) return Popped::kGone;
  ArvBuffer* popped = arv_stream_try_pop_buffer(stream_.get());
  buffer.awaited = popped == nullptr;
  if (popped == nullptr) {
    const auto timeout_us = std::chrono::microseconds(timeout).count();
    popped = arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(timeout_us));
  }
  if (popped == nullptr) return Popped::kNothing;
  const HostMoment now = hostNow();
  buffer.arrival.host_ns = now.monotonic_ns;
  buffer.arrival.raw_ns = now.raw_ns;
  buffer.handle = popped;
  account(buffer.arrival);
  describe(popped, buffer);
  if (buffer.arrival.complete) {
    isSeen_ = true;
  } else if (!isSeen_ && ++broken_ == kFirstFrames) {  // the next opening finds out why
    *isDoubted_ = true;
    giveBack(std::exchange(buffer.handle, nullptr));
    return Popped::kBroken;
  }
  return Popped::kBuffer;
}

/// Frames that are up to a hundred older than the newest, Aravis takes for late, and throws away.
void AravisDriver::account(Arrival& arrival) {
  if (framePackets_ == 0) return;
  const auto read = [this](const char* name) {
    return static_cast<std::int64_t>(arv_stream_get_info_uint64_by_name(stream_.get(), name));
  };
  const Packets before =
      std::exchange(packets_, {.ignored = read("n_ignored_packets"), .twice = read("n_duplicated_packets")});
  const auto perFrame = static_cast<std::int64_t>(framePackets_);
  const std::int64_t ignored = packets_.ignored - before.ignored;
  arrival.thrown = static_cast<std::uint64_t>(ignored / perFrame);
  arrival.duplicated = packets_.twice != before.twice;
}

/// What Aravis has kept of a whole frame's leader. Asked for the picture of something that is none, it complains on the
/// console.
SentPicture leaderOf(ArvBuffer* from) {
  SentPicture sent;
  sent.payloadType = arv_buffer_get_payload_type(from);
  if (sent.payloadType != SentPicture::kPicture && sent.payloadType != SentPicture::kPictureAndChunks) return sent;
  arv_buffer_get_image_region(from, &sent.x, &sent.y, &sent.width, &sent.height);
  arv_buffer_get_image_padding(from, &sent.paddingX, &sent.paddingY);
  sent.format = arv_buffer_get_image_pixel_format(from);
  return sent;
}

void AravisDriver::describe(ArvBuffer* from, Buffer& buffer) {
  Arrival& arrival = buffer.arrival;
  arrival.complete = arv_buffer_get_status(from) == ARV_BUFFER_STATUS_SUCCESS;
  arrival.id = arv_buffer_get_frame_id(from);
  arrival.device_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(from));
  if (!arrival.complete) return;
  std::size_t size = 0;  // with what lies behind the picture
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(from, &size));
  size = std::min(size, payload_);
  SentPicture sent = leaderOf(from);
  sent.size = size;
  Chunks found;
  const auto readBehind = [&](std::size_t picture_bytes) {
    return readChunks({data, size}, picture_bytes, !info_.zeroIsAnId, chunks_.fields, found);
  };
  if (sent.payloadType == SentPicture::kChunks) sent.size = readBehind(1).value_or(0);
  auto layout = layoutOf(sent, info_.shape);
  if (layout && sent.payloadType != SentPicture::kChunks) {
    if (size > layout->bytes && arv_buffer_has_chunks(from)) readBehind(layout->bytes);
    if (!offset_) offset_ = {sent.x, sent.y};
    if (*offset_ != std::pair(sent.x, sent.y)) layout.reset();
  }
  if (!layout) {
    unfit_ = sent;
    arrival.shape = {sent.width, sent.height, info_.shape.size, sent.format};
    if (arrival.shape == info_.shape) arrival.shape.size = 0;  // the rows are not where they should be
    return;
  }
  arrival.shape = info_.shape;
  buffer.extras = found.extras;
  const float temperature_C = temperature_C_;
  buffer.extras.hasTemperature = std::isfinite(temperature_C);
  if (buffer.extras.hasTemperature) buffer.extras.temperature_C = temperature_C;
  if (arrival.device_ns == 0 && found.timestamp_ns) arrival.device_ns = *found.timestamp_ns;
  if (arrival.id == 0 && found.frameId) arrival.id = *found.frameId;
  buffer.data = data;
  buffer.stride = layout->stride;
}

std::string AravisDriver::objection() const {
  const std::string why = deviation(unfit_, info_.shape);
  return why.empty() ? "says that its picture has moved on the sensor" : why;
}

}  // namespace

OpenDriver fromAravis(const CameraOptions& options, std::shared_ptr<ThreadWatch> watch) {
  return [options, watch = std::move(watch), isDoubted = std::make_shared<std::atomic<bool>>(false)](
             const Opening& opening) { return AravisDriver::open(options, opening, watch, isDoubted); };
}

}  // namespace tractiond::capture
