// Strategy. A Session is one opened camera: found, controlled, set, read back, streaming, its packet size proved by a
// whole frame. next() only pops, judges and hands on. When the camera falls silent or says that control is lost, the
// session goes to the keeper, which closes it and opens others until one is good; next() takes that over. A buffer
// that was out while its stream died carries the number of its session, and is freed instead of returned.
#include "daemon/capture/aravis_camera.h"

#include "daemon/base/clock.h"
#include "daemon/capture/camera_setup.h"

#include <arv.h>
#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;

/// At most one try a second.
constexpr std::int64_t kRetry_ns = 1'000'000'000;

}  // namespace

// ---------------------------------------------------------------- session

struct AravisCamera::Session {
  std::atomic<bool> controlLost{false};  // set by Aravis's heartbeat thread: outlives the camera
  Ref<ArvCamera> camera;
  Ref<ArvStream> stream;
  CameraInfo info;
  PictureShape shape;
  std::uintptr_t number = 0;
  bool silent = false;

  static tl::expected<std::unique_ptr<Session>, Error> open(const CameraOptions& options, const std::stop_token& stop,
                                                            const Say& say);
  ~Session();

 private:
  enum class Proof { kWhole, kBroken, kNothing };

  tl::expected<void, Error> start(const CameraOptions& options);
  tl::expected<void, Error> startStream(const CameraOptions& options, int packetSize_bytes);
  Proof awaitWholeFrame() const;
};

AravisCamera::Session::~Session() {
  if (stream && !silent && !controlLost) arv_camera_stop_acquisition(camera.get(), nullptr);
  stream.reset();
  camera.reset();
}

tl::expected<std::unique_ptr<AravisCamera::Session>, Error>
AravisCamera::Session::open(const CameraOptions& options, const std::stop_token& stop, const Say& say) {
  static std::atomic<std::uintptr_t> sessions{0};
  auto session = std::make_unique<Session>();
  session->number = ++sessions;
  auto connected = connectCamera(options, stop, say);
  if (!connected) return tl::unexpected(connected.error());
  session->camera = std::move(*connected);
  ArvCamera* camera = session->camera.get();
  session->info.name = nameOf(camera);
  g_signal_connect(arv_camera_get_device(camera), "control-lost",
                   G_CALLBACK(+[](ArvDevice*, std::atomic<bool>* lost) { lost->store(true); }), &session->controlLost);

  if (auto set = applySettings(camera, options, session->info); !set) return tl::unexpected(set.error());
  auto shape = readPicture(camera, session->info);
  if (!shape) return tl::unexpected(shape.error());
  session->shape = *shape;
  if (auto started = session->start(options); !started) return tl::unexpected(started.error());
  return session;
}

tl::expected<void, Error> AravisCamera::Session::start(const CameraOptions& options) {
  arv_camera_set_acquisition_mode(camera.get(), ARV_ACQUISITION_MODE_CONTINUOUS, nullptr);
  if (!arv_camera_is_gv_device(camera.get())) {
    if (arv_camera_is_uv_device(camera.get())) {
      arv_camera_uv_set_usb_mode(camera.get(), ARV_UV_USB_MODE_ASYNC);
      const std::string warning = usbMemoryWarning(shape.size * static_cast<std::size_t>(options.buffers));
      if (!warning.empty()) info.warnings.push_back(warning);
    }
    return startStream(options, 0);
  }

  const bool allowed = options.packetSocket != PacketSocket::kOff && packetSocketAllowed();
  if (options.packetSocket == PacketSocket::kOn && !allowed)
    return failed(EX_NOPERM, "camera.packet_socket = \"on\" needs the capability CAP_NET_RAW");
  info.packetSocket = allowed;
  arv_camera_gv_set_stream_options(camera.get(),
                                   allowed ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  arv_camera_gv_set_packet_size_adjustment(camera.get(), ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);

  const auto sizes = packetSizes(camera.get(), options);
  if (!sizes) return tl::unexpected(sizes.error());
  Proof proof = Proof::kNothing;
  for (std::size_t i = 0; i < sizes->size() && (i == 0 || proof == Proof::kBroken); ++i) {
    if (auto started = startStream(options, (*sizes)[i]); !started) return started;
    proof = awaitWholeFrame();
  }
  info.packetSizeVerified = proof == Proof::kWhole;
  if (proof == Proof::kBroken)
    info.warnings.push_back("no whole frame has arrived yet, not even with packets of " +
                            std::to_string(info.packetSize_bytes) + " bytes: the network loses packets");
  if (!info.packetSocket && info.receiveBuffer_bytes < options.receiveBuffer_bytes)
    info.warnings.push_back("the kernel grants a receive buffer of " + std::to_string(info.receiveBuffer_bytes) +
                            " bytes instead of " + std::to_string(options.receiveBuffer_bytes) +
                            "; sysctl -w net.core.rmem_max=" + std::to_string(options.receiveBuffer_bytes));
  return {};
}

tl::expected<void, Error> AravisCamera::Session::startStream(const CameraOptions& options, int packetSize_bytes) {
  if (stream) arv_camera_stop_acquisition(camera.get(), nullptr);
  stream.reset();
  GError* error = nullptr;
  if (packetSize_bytes > 0) {
    arv_camera_gv_set_packet_size(camera.get(), packetSize_bytes, &error);
    if (error == nullptr) info.packetSize_bytes = static_cast<int>(arv_camera_gv_get_packet_size(camera.get(), &error));
    if (error != nullptr)
      return failed(EX_CONFIG, "the camera refuses packets of " + std::to_string(packetSize_bytes) + " bytes", error);
  }
#if ARAVIS_CHECK_VERSION(0, 9, 0)
  stream.reset(arv_camera_create_stream(camera.get(), nullptr, nullptr, nullptr, &error));
#else
  stream.reset(arv_camera_create_stream(camera.get(), nullptr, nullptr, &error));
#endif
  if (!stream) return failed(EX_UNAVAILABLE, "the camera's stream cannot be opened", error);
  if (ARV_IS_GV_STREAM(stream.get())) {
    g_object_set(stream.get(), "packet-timeout", static_cast<guint>(options.packetTimeout_us), "frame-retention",
                 static_cast<guint>(options.frameRetention_us), nullptr);
    info.receiveBuffer_bytes = setReceiveBuffer(stream.get(), options.receiveBuffer_bytes);
  }
  const guint payload = arv_camera_get_payload(camera.get(), &error);
  if (error != nullptr || payload < shape.size)
    return failed(EX_UNAVAILABLE,
                  "the camera announces " + std::to_string(payload) + " bytes for a picture of " +
                      std::to_string(shape.size),
                  error);
  for (int i = 0; i < options.buffers; ++i) {
    ArvBuffer* buffer = arv_buffer_new_full(payload, nullptr, reinterpret_cast<void*>(number), nullptr);
    std::size_t unused = 0;
    // Touched now, no page is faulted in later.
    std::memset(const_cast<void*>(arv_buffer_get_data(buffer, &unused)), 0, payload);
    arv_stream_push_buffer(stream.get(), buffer);
  }
  arv_camera_start_acquisition(camera.get(), &error);
  if (error != nullptr) return failed(EX_UNAVAILABLE, "the camera does not start", error);
  return {};
}

AravisCamera::Session::Proof AravisCamera::Session::awaitWholeFrame() const {
  // Four frames, should they be slow; of a camera that waits for its trigger nothing comes.
  const double patience_s = std::clamp(info.frameRate_Hz > 0 ? 4.0 / info.frameRate_Hz : 1.0, 1.0, 5.0);
  const std::int64_t until_ns = monotonicNow() + std::llround(patience_s * 1e9);
  int broken = 0;
  while (broken < 3) {
    const std::int64_t left_ns = until_ns - monotonicNow();
    ArvBuffer* buffer =
        left_ns <= 0 ? nullptr : arv_stream_timeout_pop_buffer(stream.get(), static_cast<guint64>(left_ns / 1000));
    if (buffer == nullptr) break;
    const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    arv_stream_push_buffer(stream.get(), buffer);
    if (whole) return Proof::kWhole;
    ++broken;
  }
  return broken > 0 ? Proof::kBroken : Proof::kNothing;
}

// ---------------------------------------------------------------- keeper

struct AravisCamera::Keeper {
  std::stop_source stop;
  std::mutex mutex;
  std::condition_variable changed;
  Say say;                         // guarded; empty once the camera is gone
  std::unique_ptr<Session> ready;  // guarded
  bool done = false;               // guarded

  static std::thread start(const std::shared_ptr<Keeper>& keeper, std::unique_ptr<Session> lost, CameraOptions options);
  std::unique_ptr<Session> reopen(std::unique_ptr<Session> lost, CameraOptions options);
  void tell(const std::string& line) {
    const std::lock_guard lock(mutex);
    if (say) say(line);
  }
};

std::thread AravisCamera::Keeper::start(const std::shared_ptr<Keeper>& keeper, std::unique_ptr<Session> lost,
                                        CameraOptions options) {
  return std::thread([keeper, lost = std::move(lost), options = std::move(options)]() mutable {
    pthread_setname_np(pthread_self(), "camera-keeper");
    auto session = keeper->reopen(std::move(lost), std::move(options));
    const std::lock_guard lock(keeper->mutex);
    keeper->ready = std::move(session);
    keeper->done = true;
    keeper->changed.notify_all();
  });
}

std::unique_ptr<AravisCamera::Session> AravisCamera::Keeper::reopen(std::unique_ptr<Session> lost,
                                                                    CameraOptions options) {
  const CameraName name = lost->info.name;
  const PictureShape shape = lost->shape;
  const bool first = options.id.empty();
  // As it was, should it come back with its defaults.
  options.width = shape.width;
  options.height = shape.height;
  options.pixelFormat = traitsOf(static_cast<PixelFormat>(shape.format)).name;
  lost.reset();
  std::string told;
  for (bool byAddress = true; !stop.stop_requested(); byAddress = !byAddress) {
    const std::int64_t next_ns = monotonicNow() + kRetry_ns;
    // Not the first camera found, but the same one. Its address answers fastest, and may be a new one.
    if (first) options.id = byAddress && !name.address.empty() ? name.address : name.vendor + "-" + name.serial;
    auto opened = Session::open(options, stop.get_token(), {});
    std::string problem;
    if (!opened)
      problem = opened.error().message();
    else if ((*opened)->info.name.vendor != name.vendor || (*opened)->info.name.serial != name.serial)
      problem = "another camera answers, " + (*opened)->info.name.id;
    else if ((*opened)->shape != shape)
      problem = "camera " + name.id + " came back with another picture";
    else
      return std::move(*opened);
    if (problem != told) tell(problem);
    told = problem;
    pauseUntil(next_ns, stop.get_token());
  }
  return nullptr;
}

// ---------------------------------------------------------------- camera

tl::expected<std::unique_ptr<AravisCamera>, Error> AravisCamera::open(const CameraOptions& options, Ledger& ledger,
                                                                      const std::stop_token& stop, Say say) {
  bool told = false;
  while (!stop.stop_requested()) {
    const std::int64_t next_ns = monotonicNow() + kRetry_ns;
    auto session = Session::open(options, stop, say);
    if (session)
      return std::unique_ptr<AravisCamera>(new AravisCamera(options, ledger, std::move(say), std::move(*session)));
    if (stop.stop_requested()) break;
    if (session.error().exitCode != EX_UNAVAILABLE || !options.wait) return tl::unexpected(session.error());
    if (say && !told) say(session.error().message());
    told = true;
    pauseUntil(next_ns, stop);
  }
  return failed(EX_OK, "stopped while waiting");
}

AravisCamera::AravisCamera(const CameraOptions& options, Ledger& ledger, Say say, std::unique_ptr<Session> session)
    : options_(options)
    , ledger_(ledger)
    , say_(std::move(say))
    , info_(session->info)
    , gate_(session->shape, FrameGate::Options{.zeroIsAnId = !ARV_IS_GV_STREAM(session->stream.get())})
    , session_(std::move(session))
    , lastArrival_ns_(monotonicNow()) {}

AravisCamera::~AravisCamera() {
  constexpr milliseconds kPatience{500};
  if (!keeper_) {
    std::stop_source stopped;
    stopped.request_stop();
    giveUp(stopped);
  }
  keeper_->stop.request_stop();
  std::unique_lock lock(keeper_->mutex);
  keeper_->say = {};
  const bool done = keeper_->changed.wait_for(lock, kPatience, [&] { return keeper_->done; });
  lock.unlock();
  // A dead camera would hold us for ten seconds; the thread owns all that it still needs.
  if (done)
    keeperThread_.join();
  else
    keeperThread_.detach();
}

Next AravisCamera::next(Frame& frame, milliseconds timeout) {
  if (!session_ && !adopt(timeout)) return Next::kTimeout;
  void* buffer = nullptr;
  if (!session_->controlLost) {
    const auto timeout_us = std::chrono::microseconds(timeout).count();
    buffer = arv_stream_timeout_pop_buffer(session_->stream.get(), static_cast<guint64>(timeout_us));
  }
  if (buffer != nullptr) return judge(frame, buffer);

  const std::int64_t silence_ns = monotonicNow() - lastArrival_ns_;
  session_->silent =
      options_.silenceTimeout_ms > 0 && silence_ns > std::int64_t{options_.silenceTimeout_ms} * 1'000'000;
  if (session_->silent || session_->controlLost) {
    if (say_) say_("camera " + info_.name.id + (session_->silent ? " fell silent" : " is no longer under control"));
    giveUp();
  }
  return Next::kTimeout;
}

Next AravisCamera::judge(Frame& frame, void* handle) {
  Arrival arrival;
  arrival.host_ns = monotonicNow();
  const std::int64_t real_ns = realNow();
  lastArrival_ns_ = arrival.host_ns;
  auto* buffer = static_cast<ArvBuffer*>(handle);
  arrival.complete = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
  arrival.id = arv_buffer_get_frame_id(buffer);
  arrival.device_ns = static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer));
  const void* data = nullptr;
  // Asked for the picture of something that is none, Aravis complains on the console.
  const ArvBufferPayloadType payload = arv_buffer_get_payload_type(buffer);
  if (arrival.complete &&
      (payload == ARV_BUFFER_PAYLOAD_TYPE_IMAGE || payload == ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA)) {
    data = arv_buffer_get_image_data(buffer, &arrival.shape.size);
    arrival.shape.width = arv_buffer_get_image_width(buffer);
    arrival.shape.height = arv_buffer_get_image_height(buffer);
    arrival.shape.format = arv_buffer_get_image_pixel_format(buffer);
  }
  const Judgement judgement = gate_.judge(arrival);
  count(judgement, ledger_);
  if (judgement.verdict != Verdict::kNew) {
    arv_stream_push_buffer(session_->stream.get(), buffer);
    return Next::kRejected;
  }
  if (judgement.newTimeline) clock_.restart();
  const DeviceClock::Moment captured = clock_.add(arrival.device_ns, arrival.host_ns);

  frame = Frame{};
  frame.info.cameraFrameId = arrival.id;
  frame.info.frameNumber = judgement.frameNumber;
  frame.info.exposure_s = info_.exposure_s;
  frame.info.discontinuity = judgement.discontinuity;
  frame.info.times.device_ns = arrival.device_ns;
  frame.info.times.received_ns = arrival.host_ns;
  frame.info.times.receivedReal_ns = real_ns;
  frame.info.times.captured_ns = captured.captured_ns;
  frame.info.times.capturedError_ns = captured.error_ns;
  frame.data = static_cast<const std::uint8_t*>(data);
  frame.size = arrival.shape.size;
  frame.width = arrival.shape.width;
  frame.height = arrival.shape.height;
  frame.stride = traitsOf(info_.format).stride(arrival.shape.width);
  frame.format = info_.format;
  frame.token = buffer;
  return Next::kFrame;
}

void AravisCamera::recycle(Frame& frame) {
  if (frame.token == nullptr) return;
  auto* buffer = static_cast<ArvBuffer*>(std::exchange(frame.token, nullptr));
  frame.data = nullptr;
  const auto number = reinterpret_cast<std::uintptr_t>(arv_buffer_get_user_data(buffer));
  if (session_ && session_->number == number)
    arv_stream_push_buffer(session_->stream.get(), buffer);
  else
    g_object_unref(buffer);
}

void AravisCamera::giveUp(const std::stop_source& stop) {
  keeper_ = std::make_shared<Keeper>();
  keeper_->stop = stop;
  keeper_->say = say_;
  keeperThread_ = Keeper::start(keeper_, std::move(session_), options_);
}

bool AravisCamera::adopt(milliseconds timeout) {
  {
    std::unique_lock lock(keeper_->mutex);
    if (!keeper_->changed.wait_for(lock, timeout, [&] { return keeper_->done; })) return false;
    session_ = std::move(keeper_->ready);
  }
  keeperThread_.join();
  keeper_.reset();
  ledger_.reconnects.add();
  gate_.restart();
  lastArrival_ns_ = monotonicNow();
  if (say_) say_("camera " + info_.name.id + " is back");
  return true;
}

}  // namespace tractiond::capture
