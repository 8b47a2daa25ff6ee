#include "daemon/capture/keeper.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Shortest time between two tries to open a camera.
constexpr nanoseconds kTurn{1'000'000'000};
/// Time between two checks of the link of a streaming camera: an alarm waits for it.
constexpr nanoseconds kLinkCheck{500'000'000};
/// By so much a thread may wake late.
constexpr nanoseconds kLate{1'000'000'000};
/// Closing a dead camera takes seconds; the next try to open it does not wait for that.
constexpr milliseconds kPatience{200};
/// The log is told of repetitions no more often: a source may show each of its pictures several times.
constexpr nanoseconds kRemark{60'000'000'000};
constexpr const char* kRepeats =
    "it sends one picture again and again, equal to the byte, which noise never is: the camera's encoder, or the "
    "program that supplies the pictures, hangs; restart it, or set camera.stills = true if still pictures are meant";
/// The next turn is due.
constexpr std::int64_t kAtOnce = 0;

/// Describes camera, picture, rate, packets and receive buffer in one line for the log.
std::string summary(const CameraInfo& camera) {
  std::string line = fmt::format("camera {}: {} x {} {}", camera.name.id, camera.shape.width, camera.shape.height,
                                 traitsOf(camera.format).name);
  if (camera.frameRate_Hz > 0) line += fmt::format(", {:.4g} frames/s", camera.frameRate_Hz);
  if (camera.triggered) line += ", on trigger";
  if (camera.packetSize_bytes > 0) {
    line += fmt::format(", packets of {} bytes{}, receive buffer {} bytes", camera.packetSize_bytes,
                        camera.packetSizeVerified ? "" : " (no frame seen yet)", camera.receiveBuffer_bytes);
  }
  return line;
}

}  // namespace

Keeper::Keeper(OpenDriver open, const CameraRules& rules, Say say, CheckCamera check)
    : rules_(rules)
    , clock_(rules.clock)
    , open_(std::move(open))
    , say_(std::move(say))
    , check_(std::move(check)) {
  begin(rules_.slowest);
}

// ---------------------------------------------------------------- the keeper's thread

void Keeper::run() {
  for (std::int64_t next_ns = turn(); next_ns != kNever; next_ns = turn()) {
    const nanoseconds left(next_ns - clock_());
    if (next_ns != kAtOnce && left.count() > 0) wake_->wait(std::chrono::ceil<milliseconds>(left));
  }
}

std::int64_t Keeper::turn() {
  const bool isStopping = stop_.stop_requested();
  switch (phase_) {
  case Phase::kSearching:
    return isStopping ? finish() : search();
  case Phase::kOpened:
    return isStopping ? finish() : handleOpening();
  case Phase::kPausing:
    return isStopping ? finish() : pause();
  case Phase::kStreaming:
    return accompany();
  case Phase::kEnded:
    break;
  }
  return kNever;
}

void Keeper::begin(nanoseconds longest) {
  due_ns_ = clock_() + (longest + kLate).count();
}

std::int64_t Keeper::search() {
  if (attempt_ == 0 && before_ == nullptr) show(CameraState::kWaiting, "");
  nextTry_ns_ = clock_() + kTurn.count();
  begin(rules_.slowest);
  renew();
  Opening opening{.before = before_.get(), .attempt = attempt_, .stop = stop_.get_token()};
  opening.say = [this](LogLevel level, const std::string& line) { tell(level, line); };
  opening.found = [this] { show(CameraState::kConnecting, ""); };
  phase_ = Phase::kOpened;
  opened_ = open_(opening);
  return kAtOnce;
}

std::int64_t Keeper::handleOpening() {
  auto opened = *std::exchange(opened_, std::nullopt);
  if (!opened) return handleProblem(opened.error());
  auto seen = std::make_shared<CameraInfo>((*opened)->info());
  if (const auto problem = examine(*seen)) {
    (*opened)->undo();
    opened->reset();
    return handleProblem(*problem);
  }
  driver_ = *std::move(opened);
  calls_ = std::make_unique<BackgroundThread>("camera-calls", wake_);
  former_ = {};
  tellOf(*seen);
  return offer(std::move(seen));
}

/// Names what forbids the use of an opened camera.
std::optional<Error> Keeper::examine(CameraInfo& seen) {
  seen.session = before_ == nullptr ? 1 : before_->session + 1;
  if (before_ != nullptr && seen.shape != before_->shape)
    return Error{.exitCode = EX_CONFIG, .what = "camera " + seen.name.id + " came back with another picture"};
  const std::lock_guard lock(hooksMutex_);
  if (!check_) return std::nullopt;
  const auto checked = check_(seen);
  return checked ? std::nullopt : std::optional(checked.error());
}

std::int64_t Keeper::offer(std::shared_ptr<const CameraInfo> seen) {
  if (before_ && !renewed_) tell(LogLevel::kWarning, "camera " + before_->name.id + " is back");
  noteRepetition(false);  // a source that still repeats is told anew
  newest_.repeats = false;
  {
    const std::lock_guard lock(mutex_);
    info_ = before_ = std::move(seen);
    if (!stop_.stop_requested()) {  // else no thread would take it, or give it back
      doubted_ = -1;
      session_ = before_->session;
      lent_ = true;
      offered_ = driver_.get();
    }
    tried_ = true;
    changed_.notify_all();
  }
  handed_.signal();
  linkBefore_ = newest_.link;
  nextCheck_ns_ = 0;
  phase_ = Phase::kStreaming;
  show(CameraState::kStreaming, before_->waits());
  return kAtOnce;
}

std::int64_t Keeper::handleProblem(const Error& problem) {
  if (former_ && problem.exitCode != EX_UNAVAILABLE && problem.exitCode != EX_TEMPFAIL) {
    tell(LogLevel::kWarning,
         "the camera does not take what is new in the configuration, and is opened as before: " + problem.message());
    open_ = std::exchange(former_, {});
    refusedLast_ = true;
    phase_ = Phase::kSearching;
    return kAtOnce;
  }
  const std::string line = problem.message();
  const bool isFirst = before_ == nullptr;
  if (isFirst && (problem.exitCode != EX_UNAVAILABLE || !rules_.wait)) {
    show(CameraState::kUnknown, line);
    const std::lock_guard lock(mutex_);
    error_ = problem;
    phase_ = Phase::kPausing;
    stop_.request_stop();
    return kAtOnce;
  }
  show(isFirst ? CameraState::kWaiting : CameraState::kLost, line);
  if (line != std::exchange(told_, line))
    tell(isFirst ? LogLevel::kInfo : LogLevel::kWarning, (isFirst ? "waiting for a camera: " : "") + line);
  const std::lock_guard lock(mutex_);
  tried_ = true;
  changed_.notify_all();
  refuseQuestion("the camera is not there: " + line);
  begin(kTurn);
  phase_ = Phase::kPausing;
  return nextTry_ns_;
}

std::int64_t Keeper::pause() {
  if (!isRenewing() && clock_() < nextTry_ns_) return nextTry_ns_;
  ++attempt_;
  return search();
}

void Keeper::renew() {
  const std::lock_guard lock(mutex_);
  if (!renewing_.exchange(false)) return;
  if (!former_) former_ = std::move(open_);
  open_ = std::exchange(openNext_, {});
}

/// Calls the driver on another thread: where the camera is gone, a call takes seconds, and that is to be noticed.
std::int64_t Keeper::callAside(std::optional<CameraStep> step) {
  answers_ = std::make_shared<Answers>();
  const auto call = [driver = driver_, to = answers_, step = std::move(step), before = linkBefore_] {
    if (step)
      to->report = driver->serve(*step);
    else
      to->link = driver->link(before);
  };
  calls_->run(call);
  begin(kLinkCheck);
  return clock_() + kLinkCheck.count();
}

/// While the camera streams: answers questions, checks the link.
std::int64_t Keeper::accompany() {
  begin(rules_.slowest);
  handleAnswers();
  if (!lent_) return lose();
  showRepetition();
  if (stop_.stop_requested()) return clock_() + kLinkCheck.count();  // the capture thread gives it back in its own time
  doubtedThen_ns_ = doubted_;
  if (doubtedThen_ns_ != -1) {
    doubtSaid_ = driver_->doubt();
    return kAtOnce;
  }
  if (answers_) {  // one call at a time
    begin(kLinkCheck);
    return clock_() + kLinkCheck.count();
  }
  std::optional<CameraStep> step;
  {
    const std::lock_guard lock(mutex_);
    step = question_;
  }
  if (step || clock_() >= nextCheck_ns_) return callAside(std::move(step));
  begin(kLinkCheck);
  return nextCheck_ns_;
}

/// Handles what the driver answered last.
void Keeper::handleAnswers() {
  if (doubtSaid_) {
    doubtWhy_ = *std::exchange(doubtSaid_, std::nullopt);
    doubted_ = -1;  // with what was asked in the meantime
    if (!doubtWhy_.empty()) unanswered_ = doubtedThen_ns_;
  }
  if (!answers_ || !calls_->awaitIdle(milliseconds(0))) return;
  const auto answers = std::exchange(answers_, nullptr);
  if (answers->report) {
    const std::lock_guard lock(mutex_);
    answer_ = answers->report;
    question_.reset();
  }
  if (answers->link) {
    newest_.link = *answers->link;
    vitals_.put(newest_);  // while the other side takes one, the next check brings it
    nextCheck_ns_ = clock_() + kLinkCheck.count();
  }
}

/// The capture thread has given the driver back.
std::int64_t Keeper::lose() {
  if (stop_.stop_requested()) return finish();
  const auto why = [this]() -> std::string {
    switch (loss_) {
    case Loss::kReopened:
      return "";
    case Loss::kOtherPictures: {
      const std::string objection = driver_->objection();
      return "its pictures are no longer those agreed upon" + (objection.empty() ? "" : ": it " + objection);
    }
    case Loss::kNotControlled:
      return "it is no longer under our control";
    case Loss::kBroken:
      return "none of its frames is whole; it is opened again, to see why";
    case Loss::kNoAnswer:
      return doubtWhy_;
    case Loss::kSilent:
      break;
    }
    return "it fell silent";
  }();
  {
    const std::lock_guard lock(mutex_);
    refuseQuestion("the camera is lost: " + why);
  }
  renewed_ = isRenewing();
  if (renewed_) {
    show(CameraState::kConnecting, "");
  } else {
    show(CameraState::kLost, why);
    tell(LogLevel::kWarning, "camera " + driver_->info().name.id + " is lost: " + why);
  }
  close(kPatience);
  attempt_ = 0;
  told_.clear();
  phase_ = Phase::kSearching;
  return kAtOnce;
}

/// Closes the camera, after the call that may be under way. Leaves it to that thread after `patience`.
void Keeper::close(milliseconds patience) {
  if (!driver_) return;
  answers_.reset();
  calls_->run([driver = std::move(driver_)]() mutable { driver.reset(); });
  calls_->awaitIdle(patience);
  calls_.reset();
}

std::int64_t Keeper::finish() {
  due_ns_ = kNever;
  phase_ = Phase::kEnded;
  opened_.reset();
  close(rules_.slowest);
  {
    const std::lock_guard lock(mutex_);
    tried_ = true;
    done_ = true;
    changed_.notify_all();
  }
  handed_.signal();
  return kNever;
}

/// With the mutex held.
void Keeper::refuseQuestion(const std::string& why) {
  if (!question_) return;
  answer_ = tl::unexpected(why);
  question_.reset();
}

void Keeper::show(CameraState now, const std::string& why) {
  state_ = now;
  newest_.state = now;
  if (!why.empty() || now == CameraState::kStreaming) newest_.why = why;
  vitals_.put(newest_);  // while the other side takes one, the next check brings it
}

void Keeper::showRepetition() {
  const bool repeats = repeats_.load(std::memory_order_relaxed);
  if (repeats == newest_.repeats) return;
  newest_.repeats = repeats;
  show(CameraState::kStreaming, repeats ? kRepeats : before_->waits());
  if (!repeats || clock_() < nextRemark_ns_) return;
  nextRemark_ns_ = clock_() + kRemark.count();
  tell(LogLevel::kWarning, "camera " + before_->name.id + ": " + kRepeats);
}

void Keeper::tell(LogLevel level, const std::string& line) {
  const std::lock_guard lock(hooksMutex_);
  if (say_) say_(level, line);
}

void Keeper::tellOf(const CameraInfo& opened) {
  tell(LogLevel::kInfo, summary(opened));
  for (const std::string& setting : opened.settings) tell(LogLevel::kInfo, "camera: " + setting);
  for (const std::string& warning : opened.warnings) tell(LogLevel::kWarning, warning);
}

// ---------------------------------------------------------------- the capture thread

Driver* Keeper::borrow(milliseconds timeout) {
  if (Driver* driver = offered_.exchange(nullptr)) return driver;
  if (!done_) handed_.wait(timeout);
  return offered_.exchange(nullptr);
}

void Keeper::giveBack(Loss why) {
  loss_ = why;
  lent_ = false;
  wake_->signal();
}

void Keeper::doubt(std::int64_t arrival_ns) {
  doubted_ = arrival_ns;
  wake_->signal();
}

const Error* Keeper::end() const {
  return done_ && error_ ? &*error_ : nullptr;
}

// ---------------------------------------------------------------- any thread

std::shared_ptr<const CameraInfo> Keeper::info() const {
  const std::lock_guard lock(mutex_);
  return info_;
}

void Keeper::reopen(OpenDriver driver) {
  const std::lock_guard lock(mutex_);
  openNext_ = std::move(driver);
  refusedLast_ = false;
  renewing_ = true;
  wake_->signal();
}

void Keeper::ask(const CameraStep& step) {
  const std::lock_guard lock(mutex_);
  if (!lent_) {
    answer_ = tl::unexpected<std::string>("there is no camera now");
    return;
  }
  question_ = step;
  wake_->signal();
}

std::optional<tl::expected<CameraReport, std::string>> Keeper::takeAnswer() {
  const std::lock_guard lock(mutex_);
  return std::exchange(answer_, std::nullopt);
}

tl::expected<void, Error> Keeper::awaitFirstTry() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return tried_; });
  if (error_) return tl::unexpected(*error_);
  return {};
}

void Keeper::stop() {
  stop_.request_stop();
  {
    const std::lock_guard lock(hooksMutex_);
    say_ = {};
    check_ = {};
  }
  const std::lock_guard lock(mutex_);
  lent_ = false;
  wake_->signal();
}

bool Keeper::awaitEnd(milliseconds patience) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, patience, [this] { return done_.load(); });
}

}  // namespace tractiond::capture
