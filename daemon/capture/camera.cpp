// Strategy. The keeper (keeper.h) owns the driver and lends it to the capture thread, which pops, admits and hands on,
// and gives the driver back with the reason. A buffer that is out when its driver goes carries the number of its
// session, and is discarded instead of given back.
#include "daemon/capture/camera.h"

#include <pthread.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;

/// A dead camera would hold us for ten seconds.
constexpr milliseconds kPatienceAtEnd{500};

}  // namespace

tl::expected<std::unique_ptr<Camera>, Error> Camera::open(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                                          Say say, Welcome welcome) {
  auto camera = withoutThread(std::move(driver), rules, ledger, std::move(say), std::move(welcome));
  camera->keeperThread_ = std::thread([shared = camera->keeper_] {
    pthread_setname_np(pthread_self(), "camera-keeper");
    shared->run();
  });
  if (auto tried = camera->keeper_->awaitFirstTry(); !tried) return tl::unexpected(tried.error());
  return camera;
}

std::unique_ptr<Camera> Camera::withoutThread(OpenDriver driver, const CameraRules& rules, Ledger& ledger, Say say,
                                              Welcome welcome) {
  return std::unique_ptr<Camera>(new Camera(
      rules, ledger, std::make_shared<Keeper>(std::move(driver), rules, std::move(say), std::move(welcome))));
}

Camera::Camera(const CameraRules& rules, Ledger& ledger, std::shared_ptr<Keeper> keeper)
    : rules_(rules)
    , ledger_(ledger)
    , intake_(ledger)
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
  const Arrival& arrival = buffer.arrival;
  constexpr std::int64_t kForgotten = 64;  // a part in as many, with each arrival
  longest_ns_ = std::max(arrival.host_ns - lastArrival_ns_, longest_ns_ - longest_ns_ / kForgotten);
  lastArrival_ns_ = arrival.host_ns;
  const Judgement judgement = intake_.admit(buffer, *driver_, frame);
  if (judgement.verdict != Verdict::kNew) return Next::kRejected;
  lastWhole_ns_ = arrival.host_ns;
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
  CameraInfo info = driver_->info();
  info.session = session_;
  intake_.begin(info, rules_.buffers);
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
