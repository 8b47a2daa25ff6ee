// Strategy. The keeper (keeper.h) owns the driver and lends it to the capture thread, which pops, admits and hands on,
// and gives the driver back with the reason. A buffer that is out when its driver goes carries the number of its
// session, and is discarded instead of given back.
#include "daemon/capture/camera.h"

#include "base/clock.h"

#include <pthread.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;

/// A dead camera would hold us for ten seconds.
constexpr milliseconds kPatienceAtEnd{500};

/// Of 64 places all over the picture: the noise of a sensor alone makes it another in every picture.
std::uint64_t contentOf(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kPlaces = 64;
  std::array<std::uint64_t, kPlaces> sample{};
  if (size < sizeof sample) return XXH3_64bits(data, size);
  const std::size_t step = (size - sizeof(std::uint64_t)) / (kPlaces - 1);
  for (std::size_t i = 0; i < kPlaces; ++i) std::memcpy(&sample[i], data + i * step, sizeof sample[i]);
  return XXH3_64bits(sample.data(), sizeof sample);
}

/// Returns whether every sample of a picture is 0, or every sample the brightest: such a picture repeats without a
/// fault, as behind a lens cap.
bool isClipped(const std::uint8_t* data, std::size_t size, const PixelFormatTraits& format) {
  std::uint16_t first = 0;
  if (size < sizeof first) return false;
  std::memcpy(&first, data, sizeof first);
  const bool isBrightest = first == 0xffff || (format.packing == PixelPacking::kWhole && first == format.full());
  return (first == 0 || isBrightest) && std::memcmp(data, data + sizeof first, size - sizeof first) == 0;
}

}  // namespace

tl::expected<std::unique_ptr<Camera>, Error> Camera::open(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                                          Say say, CheckCamera check) {
  auto camera = withoutThread(std::move(driver), rules, ledger, std::move(say), std::move(check));
  camera->keeperThread_ = std::thread([shared = camera->keeper_] {
    pthread_setname_np(pthread_self(), "camera-keeper");
    shared->run();
  });
  if (auto tried = camera->keeper_->awaitFirstTry(); !tried) return tl::unexpected(tried.error());
  return camera;
}

std::unique_ptr<Camera> Camera::withoutThread(OpenDriver driver, const CameraRules& rules, Ledger& ledger, Say say,
                                              CheckCamera check) {
  return std::unique_ptr<Camera>(
      new Camera(rules, ledger, std::make_shared<Keeper>(std::move(driver), rules, std::move(say), std::move(check))));
}

Camera::Camera(const CameraRules& rules, Ledger& ledger, std::shared_ptr<Keeper> keeper)
    : rules_(rules)
    , ledger_(ledger)
    , keeper_(std::move(keeper)) {}

Camera::~Camera() {
  keeper_->stop();
  if (!keeperThread_.joinable()) return;
  if (keeper_->awaitEnd(kPatienceAtEnd))
    keeperThread_.join();
  else
    keeperThread_.detach();  // it owns all that it still needs
}

Next Camera::next(Frame& frame, milliseconds timeout) {
  if (ended_) return Next::kEnd;
  if (driver_ != nullptr && keeper_->isRenewing()) giveUp(Loss::kReopened);
  if (driver_ == nullptr && !adopt(timeout)) return ended_ ? Next::kEnd : Next::kTimeout;
  const std::int64_t patience_ns = patience();
  Buffer buffer;
  const Popped popped = driver_->pop(buffer, std::min(timeout, milliseconds(patience_ns / 4'000'000)));
  if (popped == Popped::kBuffer) {
    const Next next = admit(frame, buffer);
    if (next != Next::kFrame) {
      driver_->giveBack(buffer.handle);
      // Whole pictures of another shape: its settings were changed behind our back.
      const std::int64_t silence_ns = buffer.arrival.host_ns - lastWhole_ns_;
      if (rules_.silenceTimeout_ms > 0 && silence_ns > std::int64_t{rules_.silenceTimeout_ms} * 1'000'000 &&
          buffer.arrival.complete && !(buffer.arrival.shape == driver_->info().shape))
        giveUp(Loss::kOtherPictures);
    }
    return next;
  }
  if (popped == Popped::kEnd) return end(driver_->end()), Next::kEnd;
  if (popped == Popped::kGone) return giveUp(Loss::kNotControlled), Next::kTimeout;
  if (popped == Popped::kBroken) return giveUp(Loss::kBroken), Next::kTimeout;
  if (rules_.silenceTimeout_ms == 0 || driver_->info().triggered) return Next::kTimeout;
  const std::int64_t now_ns = rules_.clock();
  const bool dead = keeper_->isUnanswered(lastArrival_ns_);
  if (dead || now_ns - lastArrival_ns_ > std::int64_t{rules_.silenceTimeout_ms} * 1'000'000) {
    driver_->markSilent();
    giveUp(dead ? Loss::kNoAnswer : Loss::kSilent);
  } else if (now_ns - std::max(lastArrival_ns_, lastDoubt_ns_) > patience_ns) {
    lastDoubt_ns_ = now_ns;
    keeper_->doubt(lastArrival_ns_);
  }
  return Next::kTimeout;
}

/// Without a frame for longer a camera is asked whether it is there [ns]. One that is late anyway gets more time.
std::int64_t Camera::patience() const {
  constexpr double kFrames = 3;
  constexpr std::int64_t kLeast_ns = 50'000'000, kMost_ns = 1'000'000'000, kIntervals = 2;
  const double rate_Hz = driver_->info().frameRate_Hz;
  if (rate_Hz <= 0) return kMost_ns;
  const std::int64_t usual_ns = std::max<std::int64_t>(std::llround(kFrames * 1e9 / rate_Hz), kLeast_ns);
  return std::min(std::max(usual_ns, kIntervals * longest_ns_), kMost_ns);
}

Next Camera::admit(Frame& frame, const Buffer& buffer) {
  Arrival arrival = buffer.arrival;
  constexpr std::int64_t kForgotten = 64;  // a part in as many, with each arrival
  longest_ns_ = std::max(arrival.host_ns - lastArrival_ns_, longest_ns_ - longest_ns_ / kForgotten);
  lastArrival_ns_ = arrival.host_ns;
  const std::int64_t real_ns = realNow();
  if (arrival.complete && buffer.data != nullptr) {
    const std::size_t size = arrival.shape.size;
    arrival.content = contentOf(buffer.data, size);
    if (arrival.content == content_ && !rules_.stills &&
        !isClipped(buffer.data, size, traitsOf(driver_->info().format)))
      arrival.whole = XXH3_64bits(buffer.data, size);
    content_ = arrival.content;
  }
  const Judgement judgement = gate_->judge(arrival);
  count(judgement, ledger_);
  const bool repeats = judgement.verdict == Verdict::kRepeated;
  if (judgement.verdict != Verdict::kNew && !repeats) return Next::kRejected;
  keeper_->noteRepetition(repeats);
  lastWhole_ns_ = arrival.host_ns;
  if (driver_->takeClock(asked_)) clock_.learn(asked_);
  const DeviceClock::Moment captured = clock_.add(arrival, judgement, buffer.awaited);
  if (repeats) return Next::kRejected;
  const CameraInfo& info = driver_->info();
  frame = Frame{};
  frame.info.cameraFrameId = arrival.id;
  frame.info.frameNumber = judgement.frameNumber;
  frame.info.exposure_s = buffer.extras.exposure_s > 0 ? buffer.extras.exposure_s : info.exposure_s;
  frame.info.extras = buffer.extras;
  frame.info.discontinuity = judgement.discontinuity;
  frame.info.doubted = judgement.doubted;
  frame.info.times.device_ns = arrival.device_ns;
  frame.info.times.received_ns = arrival.host_ns;
  frame.info.times.receivedReal_ns = real_ns;
  frame.info.times.captured_ns = captured.captured_ns;
  frame.info.times.capturedError_ns = captured.error_ns;
  frame.info.times.capturedBound = captured.bound;
  frame.data = buffer.data;
  // From the first row to the end of the last.
  frame.size = buffer.stride == 0
                   ? info.shape.size
                   : static_cast<std::size_t>(buffer.stride) * static_cast<std::size_t>(info.shape.height - 1) +
                         traitsOf(info.format).size(info.shape.width, 1);
  frame.width = arrival.shape.width;
  frame.height = arrival.shape.height;
  frame.stride = buffer.stride;
  frame.format = info.format;
  frame.token = buffer.handle;
  frame.session = session_;
  return Next::kFrame;
}

void Camera::recycle(Frame& frame) {
  if (frame.token == nullptr) return;
  void* handle = std::exchange(frame.token, nullptr);
  frame.data = nullptr;
  if (driver_ != nullptr && frame.session == session_)
    driver_->giveBack(handle);
  else
    discard_(handle);
}

bool Camera::adopt(milliseconds timeout) {
  driver_ = keeper_->borrow(timeout);
  if (driver_ == nullptr) {
    if (const Error* const why = keeper_->end()) end(*why);
    return false;
  }
  session_ = keeper_->session();
  discard_ = driver_->discard();
  if (session_ > 1) ledger_.reconnects.add();
  const CameraInfo& info = driver_->info();
  clock_.learn({});
  if (gate_)
    gate_->restart();
  else
    gate_.emplace(info.shape,
                  FrameGate::Options{.zeroIsAnId = info.zeroIsAnId,
                                     .memory = static_cast<std::size_t>(std::max(256, rules_.buffers + 64))});
  lastArrival_ns_ = lastWhole_ns_ = rules_.clock();
  longest_ns_ = 0;
  return true;
}

void Camera::giveUp(Loss why) {
  driver_ = nullptr;
  keeper_->giveBack(why);
}

void Camera::end(Error error) {
  error_ = std::move(error);
  ended_ = true;
}

}  // namespace tractiond::capture
