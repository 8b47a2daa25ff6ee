// Strategy. Found, controlled, set, read back, streaming, its packet size proved by a whole frame: then it is open.
#include "daemon/capture/aravis_driver.h"

#include "base/clock.h"
#include "daemon/capture/aravis.h"
#include "daemon/capture/chunk_description.h"
#include "daemon/capture/gvcp_search.h"
#include "daemon/capture/silence.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <thread>
#include <tuple>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;

class AravisDriver : public Driver {
 public:
  static tl::expected<std::unique_ptr<Driver>, Error> open(const CameraOptions& options, const Opening& opening,
                                                           const std::function<void(bool)>& receiving);
  ~AravisDriver() override;

  const CameraInfo& info() const override { return info_; }
  Popped pop(Buffer& buffer, milliseconds timeout) override;
  void giveBack(void* handle) override { arv_stream_push_buffer(stream_.get(), static_cast<ArvBuffer*>(handle)); }
  bool takeClock(ClockFit& fit) override { return clock_ && clock_->take(fit); }
  Discard discard() const override {
    return [](void* handle) { g_object_unref(handle); };
  }
  std::string doubt() override;
  void markSilent() override { silent_ = true; }
  void undo() override;
  CameraLink link(const CameraLink& before) override {
    return readLink(camera_.get(), stream_.get(), guard_, before, [this] { return silent_ || controlLost_; });
  }
  tl::expected<CameraReport, std::string> serve(const CameraStep& step) override {
    return serveFeatures(camera_.get(), step, options_.features, first_);
  }

 private:
  enum class Proof { kWhole, kBroken, kNothing };
  static constexpr milliseconds kAnswer{130};

  static void onStream(void* driver, ArvStreamCallbackType type, ArvBuffer*);
  tl::expected<void, Error> setUp(const CameraOptions& wanted, const CameraInfo* before);
  tl::expected<void, Error> start();
  tl::expected<void, Error> startStream(int packetSize_bytes);
  Proof awaitWholeFrame() const;
  void describe(ArvBuffer* from, Buffer& buffer) const;
  void account(Arrival& arrival);

  CameraOptions options_;
  std::atomic<bool> controlLost_{false};  // set by Aravis's heartbeat thread: outlives the camera
  std::atomic<bool> silent_{false};
  std::atomic<int> receivingThread_{0};  ///< Aravis's
  std::function<void(bool)> receiving_;
  GvcpSearch search_;
  ControlGuard guard_;  // before the camera, and after every other socket of this
  Ref<ArvCamera> camera_;
  Ref<ArvStream> stream_;
  std::unique_ptr<AskedClock> clock_;  ///< none: it cannot be asked
  CameraInfo info_;
  std::size_t payload_ = 0;  ///< bytes of a buffer
  std::uint64_t framePackets_ = 0;
  struct Packets {
    std::int64_t ignored = 0, twice = 0, asked = 0, noRoom = 0;
  } packets_;                  ///< when they were counted last
  std::int64_t expected_ = 0;  ///< packets asked for again, which may come once more
  std::int64_t asked_ns_ = 0;  ///< when that was last
  bool portIsTrue_ = true;     ///< the camera sends from the port that it names
  ChunkDescription chunks_;
  std::vector<Feature> undo_;                               ///< features as they were before it was set up
  std::vector<std::pair<std::string, std::string>> first_;  ///< features as they were before people wrote them
};

AravisDriver::~AravisDriver() {
  clock_.reset();
  if (stream_ && !silent_ && !controlLost_) arv_camera_stop_acquisition(camera_.get(), nullptr);
  stream_.reset();
  guard_.disarm();
  camera_.reset();
}

tl::expected<std::unique_ptr<Driver>, Error> AravisDriver::open(const CameraOptions& options, const Opening& opening,
                                                                const std::function<void(bool)>& receiving) {
  auto driver = std::make_unique<AravisDriver>();
  driver->options_ = options;
  driver->receiving_ = receiving;
  CameraOptions& wanted = driver->options_;
  const CameraInfo* before = opening.before;
  if (before != nullptr) {
    // As it was, should it come back with its defaults.
    wanted.width = before->shape.width;
    wanted.height = before->shape.height;
    wanted.pixelFormat = traitsOf(before->format).name;
    // Not the first camera found, but the same one, as soon as it answers; it may have a new address.
    if (before->identity.empty() || !driver->search_.usable()) {
      if (options.id.empty()) wanted.id = before->name.vendor + "-" + before->name.serial;
    } else {
      constexpr milliseconds kPatience{1000};
      wanted.id = driver->search_.locate(before->identity, before->name.address, kPatience, opening.stop);
      if (wanted.id.empty())
        return failed(EX_UNAVAILABLE, "camera " + before->name.id + " does not answer", before->name.address);
    }
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
  if (!info.name.address.empty()) info.identity = driver->search_.ask(info.name.address, milliseconds(1000));
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
    return failed(refusal.noAnswer() ? EX_UNAVAILABLE : EX_CONFIG,
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
    return startStream(0);
  }

  const bool allowed = options_.packetSocket != PacketSocket::kOff && packetSocketAllowed();
  if (options_.packetSocket == PacketSocket::kOn && !allowed)
    return failed(EX_NOPERM, "camera.packet_socket = \"on\" needs the capability CAP_NET_RAW");
  info_.packetSocket = allowed;
  arv_camera_gv_set_stream_options(camera,
                                   allowed ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);

  const auto sizes = packetSizes(camera, options_);
  if (!sizes) return tl::unexpected(sizes.error());
  Proof proof = Proof::kNothing;
  portIsTrue_ = !info_.triggered;  // of a camera that waits, nothing comes to prove it
  for (std::size_t i = 0; i < sizes->size() && (i == 0 || proof == Proof::kBroken); ++i) {
    if (auto started = startStream((*sizes)[i]); !started) return started;
    proof = awaitWholeFrame();
    if (proof != Proof::kNothing || !portIsTrue_ || packetsRefused(stream_.get()) == 0) continue;
    portIsTrue_ = false;
    if (auto started = startStream((*sizes)[i]); !started) return started;
    proof = awaitWholeFrame();
    if (proof != Proof::kNothing)
      info_.warnings.push_back(
          "the camera does not send from the port that it says it does (GevSCSP); packets from any "
          "port of its address are taken");
  }
  info_.packetSizeVerified = proof == Proof::kWhole;
  if (proof == Proof::kBroken)
    info_.warnings.push_back("no whole frame has arrived yet, not even with packets of " +
                             std::to_string(info_.packetSize_bytes) + " bytes: the network loses packets");
  if (!info_.packetSocket && info_.receiveBuffer_bytes < options_.receiveBuffer_bytes)
    info_.warnings.push_back("the kernel grants a receive buffer of " + std::to_string(info_.receiveBuffer_bytes) +
                             " bytes instead of " + std::to_string(options_.receiveBuffer_bytes) +
                             "; sysctl -w net.core.rmem_max=" + std::to_string(options_.receiveBuffer_bytes));
  return {};
}

tl::expected<void, Error> AravisDriver::startStream(int packetSize_bytes) {
  ArvCamera* camera = camera_.get();
  if (stream_) arv_camera_stop_acquisition(camera, nullptr);
  stream_.reset();
  Failure failure;
  if (packetSize_bytes > 0) {
    arv_camera_gv_set_packet_size(camera, packetSize_bytes, failure.into());
    if (!failure) info_.packetSize_bytes = static_cast<int>(arv_camera_gv_get_packet_size(camera, failure.into()));
    if (failure)
      return failed(failure.noAnswer() ? EX_UNAVAILABLE : EX_CONFIG,
                    "the camera refuses packets of " + std::to_string(packetSize_bytes) + " bytes", failure.text());
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
    StreamShape shape = streamShape(camera, info_.packetSize_bytes, payload);
    framePackets_ = shape.blocks() + 2;  // with leader and trailer
    if (!info_.packetSocket) {
      if (!portIsTrue_) shape.cameraPort = 0;
      if (auto guarded = guardStream(stream_.get(), shape); !guarded) return guarded;
    }
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
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT) self.receivingThread_.store(gettid(), std::memory_order_relaxed);
  const auto& receiving = self.receiving_;
  if (!receiving) return;
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT) receiving(true);
  if (type == ARV_STREAM_CALLBACK_TYPE_EXIT) receiving(false);
}

AravisDriver::Proof AravisDriver::awaitWholeFrame() const {
  // Four frames, should they be slow; of a camera that waits for its trigger nothing comes.
  const double patience_s =
      info_.triggered ? 0.1 : std::clamp(info_.frameRate_Hz > 0 ? 4.0 / info_.frameRate_Hz : 1.0, 1.0, 5.0);
  const std::int64_t until_ns = monotonicNow() + std::llround(patience_s * 1e9);
  int broken = 0;
  while (broken < 3) {
    const std::int64_t left_ns = until_ns - monotonicNow();
    ArvBuffer* buffer =
        left_ns <= 0 ? nullptr : arv_stream_timeout_pop_buffer(stream_.get(), static_cast<guint64>(left_ns / 1000));
    if (buffer == nullptr) break;
    const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    arv_stream_push_buffer(stream_.get(), buffer);
    if (whole) return Proof::kWhole;
    ++broken;
  }
  return broken > 0 ? Proof::kBroken : Proof::kNothing;
}

/// A camera that is there and sends, while Aravis leaves its packets lie, can be had back by a stream of its own; what
/// hangs is left behind.
std::string AravisDriver::doubt() {
  const bool isGigE = framePackets_ != 0;
  ProcessorWait wait(receivingThread_.load(std::memory_order_relaxed));
  switch (causeOfSilence({
      .received = [&] { return isGigE ? arv_stream_get_info_uint64_by_name(stream_.get(), "n_received_packets") : 0; },
      .hasPacketsWaiting = [&] { return isGigE && bytesWaiting(stream_.get()) != 0; },
      .isWaitingForProcessor = [&] { return wait.lasts(); },
      .answers = [&] { return info_.identity.empty() || search_.ask(info_.name.address, kAnswer) == info_.identity; },
      .pause = [] { std::this_thread::sleep_for(milliseconds(50)); },
  })) {
  case Silence::kAlive:
    return "";
  case Silence::kThreadHangs:
    arv_gv_device_leave_control(ARV_GV_DEVICE(arv_camera_get_device(camera_.get())), nullptr);
    return "Aravis's thread hangs that receives its packets";
  case Silence::kNoAnswer:
    break;
  }
  return "it does not answer";
}

Popped AravisDriver::pop(Buffer& buffer, milliseconds timeout) {
  if (controlLost_.load(std::memory_order_relaxed)) return Popped::kGone;
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
  return Popped::kBuffer;
}

/// Frames that are up to a hundred older than the newest, Aravis takes for late, and throws away.
void AravisDriver::account(Arrival& arrival) {
  if (framePackets_ == 0) return;
  const auto read = [this](const char* name) {
    return static_cast<std::int64_t>(arv_stream_get_info_uint64_by_name(stream_.get(), name));
  };
  const Packets before = std::exchange(packets_, {.ignored = read("n_ignored_packets"),
                                                  .twice = read("n_duplicated_packets"),
                                                  .asked = read("n_resend_requests"),
                                                  .noRoom = read("n_underruns")});
  const auto perFrame = static_cast<std::int64_t>(framePackets_);
  const std::int64_t ignored = packets_.ignored - before.ignored;
  arrival.thrown = static_cast<std::uint64_t>(ignored / perFrame);
  // Of one that was asked for again both may come, the one that was only late and the answer, in either order.
  // A camera that is busy answers when the frame is whole long since.
  constexpr std::int64_t kAnswered_ns = 1'000'000'000;
  if (packets_.asked != before.asked) asked_ns_ = arrival.host_ns;
  if (arrival.host_ns - asked_ns_ > kAnswered_ns) expected_ = 0;
  expected_ += packets_.asked - before.asked;
  const auto unasked = [this](std::int64_t count) {
    const std::int64_t excused = std::min(count, expected_);
    expected_ -= excused;
    return count - excused;
  };
  const std::int64_t twice = packets_.twice - before.twice;
  const std::int64_t late = std::max<std::int64_t>(ignored - (packets_.noRoom - before.noRoom), 0);
  const std::int64_t unaskedTwice = unasked(twice), unaskedLate = unasked(late);
  arrival.twice = static_cast<double>(unaskedTwice) / static_cast<double>(perFrame);
  arrival.late = static_cast<double>(unaskedLate) / static_cast<double>(perFrame);
  arrival.repeated = unaskedTwice < twice || unaskedLate < late;
}

void AravisDriver::describe(ArvBuffer* from, Buffer& buffer) const {
  Arrival& arrival = buffer.arrival;
  arrival.complete = arv_buffer_get_status(from) == ARV_BUFFER_STATUS_SUCCESS;
  arrival.id = arv_buffer_get_frame_id(from);
  arrival.device_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(from));
  if (!arrival.complete) return;
  // Asked for the picture of something that is none, Aravis complains on the console.
  const ArvBufferPayloadType payload = arv_buffer_get_payload_type(from);
  if (payload != ARV_BUFFER_PAYLOAD_TYPE_IMAGE && payload != ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA) return;
  std::size_t size = 0;  // with what lies behind the picture
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(from, &size));
  arrival.shape.width = arv_buffer_get_image_width(from);
  arrival.shape.height = arv_buffer_get_image_height(from);
  arrival.shape.format = arv_buffer_get_image_pixel_format(from);
  arrival.shape.size = std::min(size, payload_);
  if (arrival.shape.size > info_.shape.size && arv_buffer_has_chunks(from)) {
    Chunks found;
    const auto picture =
        readChunks({data, arrival.shape.size}, info_.shape.size, !info_.zeroIsAnId, chunks_.fields, found);
    if (picture) arrival.shape.size = *picture;
    buffer.extras = found.extras;
    if (arrival.device_ns == 0 && found.timestamp_ns) arrival.device_ns = *found.timestamp_ns;
    if (arrival.id == 0 && found.frameId) arrival.id = *found.frameId;
  }
  // What is left beyond the picture is padding, as long as the camera announced it.
  if (arrival.shape.size > info_.shape.size && size <= payload_) arrival.shape.size = info_.shape.size;
  buffer.data = data;
  buffer.stride = traitsOf(info_.format).stride(arrival.shape.width);
}

}  // namespace

OpenDriver fromAravis(const CameraOptions& options, const std::function<void(bool)>& receiving) {
  return [options, receiving](const Opening& opening) { return AravisDriver::open(options, opening, receiving); };
}

}  // namespace tractiond::capture
