#include "tests/simulation/capture_side.h"

#include <fmt/format.h>

namespace tractiond::simulation {

CaptureSide::CaptureSide(Camera& camera, const capture::CameraOptions& options, Ledger& ledger, Journal& journal,
                         const Starvation& starvation)
    : journal_(journal)
    , starvation_(starvation)
    , connection_{camera}
    , camera_(capture::Camera::withoutThread(
          fromSimulation(connection_, options), {.buffers = kBuffers}, ledger,
          [this](capture::LogLevel level, const std::string& line) {  // as Instrument does
            journal_.say((level == capture::LogLevel::kWarning ? "log: warning: " : "log: ") + line);
            told_ += line + '\n';
          }))
    , nextPop_ns_(now())
    , came_ns_(now()) {}

capture::Next CaptureSide::next(Frame& frame, std::chrono::milliseconds timeout) {
  connection_.popWaits = timeout;
  connection_.isPopped = false;
  const capture::Next next = camera_->next(frame, timeout);
  nextPop_ns_ = now() + std::chrono::nanoseconds(connection_.popWaits).count();
  if (next == capture::Next::kFrame || next == capture::Next::kRejected) came_ns_ = now();
  return next;
}

std::int64_t CaptureSide::keeperTurn() {
  if (keeperIsBusyUntil_ns_ > now()) return keeperIsBusyUntil_ns_;
  const int before = connection_.opened;
  spent_ns() = 0;
  keeperBegan_ns_ = now();
  refused_ = connection_.refused;  // at a try that is over: this turn handles it
  const std::int64_t next_ns = camera_->keeperTurn();
  keeperIsBusyUntil_ns_ = now() + spent_ns();
  if (connection_.opened != before) {
    opened_ns_ = came_ns_ = keeperIsBusyUntil_ns_;
    nextPop_ns_ = std::min(nextPop_ns_, came_ns_);  // the capture stage is woken
  }
  return std::max(std::min(next_ns, nextIdle_ns()), keeperIsBusyUntil_ns_);
}

bool CaptureSide::isHanging() const {
  constexpr std::int64_t kLongest_ns = 31 * kSecond;
  return camera_->state() != CameraState::kStreaming && keeperIsBusyUntil_ns_ > now() &&
         now() - keeperBegan_ns_ > kLongest_ns;
}

void CaptureSide::ask(const CameraStep& step) {
  journal_.law(asked_ns_ == kNever, "the camera is asked one thing at a time", step.read().name());
  journal_.say("asked: a feature of the camera");
  asked_ns_ = now();
  camera_->ask(step);
}

void CaptureSide::takeAnswer() {
  const auto answer = camera_->takeAnswer();
  if (!answer) return;
  journal_.say("answer: " + (*answer ? "the feature" : answer->error()));
  journal_.law(asked_ns_ != kNever, "each request gets one answer", "an answer of the camera to nobody");
  asked_ns_ = kNever;
}

void CaptureSide::check() {
  constexpr std::int64_t kAnswered_ns = 7 * kSecond;  // two calls that fail, and a doubt
  journal_.law(asked_ns_ == kNever || now() - asked_ns_ - starvation_.since(asked_ns_) <= kAnswered_ns,
               "each request is answered in its time", "a feature of the camera");
  checkState();
  checkTold();
  checkNoticed();
}

void CaptureSide::checkState() const {
  const CameraState state = camera_->state();
  const bool isOpen = connection_.open > 0;
  const bool isTrue = state == CameraState::kStreaming                                ? isOpen
                      : state == CameraState::kLost || state == CameraState::kWaiting ? !isOpen
                                                                                      : connection_.open <= 1;
  journal_.law(isTrue, "the camera's state is true",
               [&] { return fmt::format("state {}, {} open", static_cast<int>(state), connection_.open); });
}

/// Why there is no camera is reported once for each time that it is lost.
void CaptureSide::checkTold() {
  const CameraState state = camera_->state();
  if (state == CameraState::kStreaming) told_.clear();
  if (state != CameraState::kLost && state != CameraState::kWaiting) return;
  journal_.law(told_.find(refused_) != std::string::npos, "the log tells why there is no camera", refused_);
}

/// A camera that only falls silent has two seconds; one that does not answer is given up earlier.
void CaptureSide::checkNoticed() const {
  if (camera_->state() != CameraState::kStreaming) return;
  constexpr std::int64_t kSilence_ns = 2500 * kMs, kGone_ns = 1750 * kMs;
  const std::int64_t silent_ns = now() - came_ns_ - starvation_.since(came_ns_);
  journal_.law(silent_ns <= kSilence_ns, "silence is noticed in time",
               [&] { return fmt::format("{} ms", silent_ns / kMs); });
  const std::int64_t gone_ns = connection_.camera.goneSince_ns();
  if (gone_ns == kNever) return;
  const std::int64_t since_ns = std::max(gone_ns, came_ns_);
  const std::int64_t missing_ns = now() - since_ns - starvation_.since(since_ns);
  journal_.law(missing_ns <= kGone_ns, "a camera that is gone is noticed in time",
               [&] { return fmt::format("{} ms", missing_ns / kMs); });
}

}  // namespace tractiond::simulation
