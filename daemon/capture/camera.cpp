// Strategy. The keeper owns the driver and lends it to the capture thread: offered, taken, given back with the reason.
// The two meet under one mutex, which the capture thread touches only while it has no driver. A buffer that is out
// when its driver goes carries the number of its session, and is discarded instead of given back.
#include "daemon/capture/camera.h"

#include "daemon/base/clock.h"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <future>
#include <limits>
#include <mutex>
#include <utility>

namespace tractiond::capture {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// Shortest time between two tries to open a camera.
constexpr nanoseconds kTurn{1'000'000'000};
/// How often the link of a streaming camera is looked at: an alarm waits for it.
constexpr nanoseconds kLook{500'000'000};
/// By so much a thread may wake late.
constexpr nanoseconds kLate{1'000'000'000};
/// A dead camera would hold us for ten seconds.
constexpr milliseconds kPatienceAtEnd{500};

/// A dead camera is taken leave of for seconds: nobody waits for that, should it come back meanwhile.
void close(std::unique_ptr<Driver> driver) {
  constexpr milliseconds kPatience{200};
  std::packaged_task<void()> task([last = std::move(driver)]() mutable { last.reset(); });
  const std::future<void> closed = task.get_future();
  std::thread(std::move(task)).detach();
  closed.wait_for(kPatience);
}

}  // namespace

// ---------------------------------------------------------------- keeper

struct Camera::Keeper {
  OpenDriver open;
  OpenDriver former;  // what `open` was, until the camera has been opened by it; else empty
  bool wait = true;
  nanoseconds slowest{0};
  std::int64_t (*clock)() = nullptr;
  std::stop_source stop;
  std::atomic<CameraState> state{CameraState::kUnknown};
  std::atomic<bool> refusedLast{false};
  std::atomic<bool> renewing{false};         // there is an `openNext`
  std::atomic<std::int64_t> due_ns{0};       // by then its next step begins, or it hangs
  std::atomic<std::int64_t> forged_ns{0};    // when the last picture came that may be somebody else's; 0: none did
  std::atomic<std::int64_t> unanswered{-1};  // nothing came after this arrival [ns], and it is to be given up
  Mailbox<CameraVitals> vitals;
  CameraVitals newest;         // the keeper's own
  std::int64_t toldOf_ns = 0;  // likewise: of `forged_ns`

  std::mutex mutex;
  std::condition_variable changed;
  // Guarded by the mutex.
  Say say;          // empty once the camera is gone
  Welcome welcome;  // likewise
  OpenDriver openNext;
  std::optional<std::int64_t> doubted;  // nothing came after this arrival [ns]: does the camera answer?
  std::shared_ptr<const CameraInfo> info;
  Driver* offered = nullptr;       // for the capture thread to take
  std::atomic<bool> lent = false;  // the capture thread has it, or may take it; read by others, too
  std::string lostWhy;
  std::string doubtWhy;  // of `unanswered`
  bool tried = false;    // the first try has ended
  bool done = false;     // the thread is at its end
  std::optional<Error> error;
  std::optional<CameraStep> question;
  std::optional<tl::expected<CameraReport, std::string>> answer;

  void run();
  void begin(nanoseconds longest) { due_ns = clock() + (longest + kLate).count(); }
  std::unique_ptr<Driver> openOne(const CameraInfo* before);
  void accompany(Driver& driver);
  void renew();
  void warnOfForgery();
  std::string whyDoubted();
  void end(Error why);
  void show(CameraState now, const std::string& why);
  void publish();
  void tell(Weight weight, const std::string& line);
  void tellOf(const CameraInfo& opened);
  tl::expected<void, Error> greet(const CameraInfo& opened);
};

void Camera::Keeper::run() {
  pthread_setname_np(pthread_self(), "camera-keeper");
  std::shared_ptr<const CameraInfo> before;
  while (!stop.stop_requested()) {
    const bool renewed = renewing;
    std::unique_ptr<Driver> driver = openOne(before.get());
    if (!driver) break;
    if (before && !renewed) tell(Weight::kWarning, "camera " + before->name.id + " is back");
    {
      const std::lock_guard lock(mutex);
      if (stop.stop_requested()) break;  // nobody would take it, or give it back
      before = info;
      offered = driver.get();
      lent = true;
      tried = true;
      changed.notify_all();
    }
    show(CameraState::kStreaming, "");
    accompany(*driver);
    if (!stop.stop_requested()) close(std::move(driver));
  }
  due_ns = std::numeric_limits<std::int64_t>::max();
  const std::lock_guard lock(mutex);
  tried = done = true;
  changed.notify_all();
}

/// None: stop was asked, or there is an error.
std::unique_ptr<Driver> Camera::Keeper::openOne(const CameraInfo* before) {
  const CameraState absent = before == nullptr ? CameraState::kWaiting : CameraState::kLost;
  if (before == nullptr) show(absent, "");
  std::string told;
  for (int attempt = 0; !stop.stop_requested(); ++attempt) {
    const std::int64_t next_ns = clock() + kTurn.count();
    begin(slowest);
    renew();
    Opening opening{
        before, attempt, stop.get_token(), [this](Weight w, const std::string& line) { tell(w, line); }, {}};
    opening.found = [this] { show(CameraState::kConnecting, ""); };
    auto opened = open(opening);
    std::optional<Error> problem;
    if (!opened) {
      problem = opened.error();
    } else {
      auto seen = std::make_shared<CameraInfo>((*opened)->info());
      seen->session = before == nullptr ? 1 : before->session + 1;
      if (before != nullptr && seen->shape != before->shape)
        problem = Error{.exitCode = EX_CONFIG, .what = "camera " + seen->name.id + " came back with another picture"};
      else if (auto welcomed = greet(*seen); !welcomed)
        problem = welcomed.error();
      if (problem) (*opened)->undo();
      if (!problem) {
        former = {};
        tellOf(*seen);
        const std::lock_guard lock(mutex);
        info = std::move(seen);
        return *std::move(opened);
      }
    }
    if (stop.stop_requested()) break;
    if (former && problem->exitCode != EX_UNAVAILABLE && problem->exitCode != EX_TEMPFAIL) {
      tell(Weight::kWarning,
           "the camera does not take what is new in the configuration, and is opened as before: " + problem->message());
      open = std::exchange(former, {});
      refusedLast = true;
      continue;
    }
    const bool worthIt = before != nullptr || (problem->exitCode == EX_UNAVAILABLE && wait);
    if (!worthIt) return end(*problem), nullptr;
    const std::string line = problem->message();
    show(absent, line);
    if (line != told)
      tell(before == nullptr ? Weight::kInfo : Weight::kWarning,
           (before == nullptr ? "waiting for a camera: " : "") + line);
    told = line;
    std::unique_lock lock(mutex);
    tried = true;
    changed.notify_all();
    if (question) answer = tl::unexpected("the camera is not there: " + line), question.reset();
    begin(kTurn);
    changed.wait_for(lock, nanoseconds(next_ns - clock()), [&] { return stop.stop_requested() || renewing; });
  }
  return nullptr;
}

void Camera::Keeper::renew() {
  const std::lock_guard lock(mutex);
  if (!renewing.exchange(false)) return;
  if (!former) former = std::move(open);
  open = std::exchange(openNext, {});
}

/// While it streams: answers questions, looks at the link. Returns when the capture thread has given it back.
void Camera::Keeper::accompany(Driver& driver) {
  std::unique_lock lock(mutex);
  const CameraLink before = newest.link;
  std::int64_t look_ns = 0;
  const auto due = [&] { return !lent || doubted.has_value() || question.has_value() || stop.stop_requested(); };
  for (;;) {
    begin(kLook);
    changed.wait_for(lock, nanoseconds(std::max<std::int64_t>(0, look_ns - clock())), due);
    begin(slowest);
    if (stop.stop_requested() && !lent) return;
    if (!lent) {
      const std::string why = lostWhy;
      if (question) answer = tl::unexpected("the camera is lost: " + why), question.reset();
      lock.unlock();
      if (renewing) return show(CameraState::kConnecting, "");
      show(CameraState::kLost, why);
      return tell(Weight::kWarning, "camera " + driver.info().name.id + " is lost: " + why);
    }
    if (stop.stop_requested()) {  // the capture thread gives it back in its own time
      changed.wait(lock, [&] { return !lent; });
      return;
    }
    if (doubted) {
      const std::int64_t arrival_ns = *doubted;
      lock.unlock();
      const std::string why = driver.doubt();
      lock.lock();
      doubted.reset();  // with what was asked in the meantime
      doubtWhy = why;
      if (!why.empty()) unanswered = arrival_ns;
    }
    if (question) {
      const CameraStep step = *question;
      lock.unlock();
      auto result = driver.serve(step);
      lock.lock();
      answer = std::move(result);
      question.reset();
    }
    if (clock() >= look_ns) {
      lock.unlock();
      newest.link = driver.link();
      newest.link.packetsResent += before.packetsResent;
      newest.link.packetsMissing += before.packetsMissing;
      newest.link.packetsRefused += before.packetsRefused;
      publish();
      warnOfForgery();
      lock.lock();
      look_ns = clock() + kLook.count();
    }
  }
}

std::string Camera::Keeper::whyDoubted() {
  const std::lock_guard lock(mutex);
  return doubtWhy;
}

/// Warns once, and again after a minute without doubt.
void Camera::Keeper::warnOfForgery() {
  constexpr std::int64_t kCalm_ns = 60'000'000'000;
  const std::int64_t last_ns = forged_ns.load(std::memory_order_relaxed);
  if (last_ns == 0 || last_ns == toldOf_ns) return;
  const std::int64_t before_ns = std::exchange(toldOf_ns, last_ns);
  if (before_ns != 0 && last_ns - before_ns < kCalm_ns) return;
  tell(
      Weight::kWarning,
      "more packets or pictures come in the camera's name than it sends: another host sends as the camera, the network "
      "duplicates packets, or packets come so late that they were requested again");
}

void Camera::Keeper::end(Error why) {
  show(CameraState::kUnknown, why.message());
  const std::lock_guard lock(mutex);
  error = std::move(why);
}

void Camera::Keeper::show(CameraState now, const std::string& why) {
  state.store(now, std::memory_order_relaxed);
  newest.state = now;
  if (!why.empty() || now == CameraState::kStreaming) newest.why = Line(why);
  publish();
}

void Camera::Keeper::publish() {
  vitals.put(newest);  // while the other side takes one, the next look brings it
}

void Camera::Keeper::tell(Weight weight, const std::string& line) {
  const std::lock_guard lock(mutex);
  if (say) say(weight, line);
}

void Camera::Keeper::tellOf(const CameraInfo& opened) {
  tell(Weight::kInfo, opened.summary());
  for (const std::string& setting : opened.settings) tell(Weight::kInfo, "camera: " + setting);
  for (const std::string& warning : opened.warnings) tell(Weight::kWarning, warning);
}

tl::expected<void, Error> Camera::Keeper::greet(const CameraInfo& opened) {
  const std::lock_guard lock(mutex);
  return welcome ? welcome(opened) : tl::expected<void, Error>();
}

// ---------------------------------------------------------------- camera

tl::expected<std::unique_ptr<Camera>, Error> Camera::open(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                                          Say say, Welcome welcome) {
  auto keeper = std::make_shared<Keeper>();
  keeper->open = std::move(driver);
  keeper->wait = rules.wait;
  keeper->slowest = rules.slowest;
  keeper->clock = rules.clock;
  keeper->say = std::move(say);
  keeper->welcome = std::move(welcome);
  std::unique_ptr<Camera> camera(new Camera(rules, ledger, keeper));
  std::unique_lock lock(keeper->mutex);
  keeper->changed.wait(lock, [&] { return keeper->tried; });
  if (keeper->error) return tl::unexpected(*keeper->error);
  return camera;
}

Camera::Camera(const CameraRules& rules, Ledger& ledger, std::shared_ptr<Keeper> keeper)
    : rules_(rules)
    , ledger_(ledger)
    , intake_(ledger)
    , keeper_(std::move(keeper))
    , keeperThread_([shared = keeper_] { shared->run(); }) {}

Camera::~Camera() {
  keeper_->stop.request_stop();
  std::unique_lock lock(keeper_->mutex);
  keeper_->say = {};
  keeper_->welcome = {};
  keeper_->lent = false;
  keeper_->changed.notify_all();
  const bool done = keeper_->changed.wait_for(lock, kPatienceAtEnd, [&] { return keeper_->done; });
  lock.unlock();
  if (done)
    keeperThread_.join();
  else
    keeperThread_.detach();  // it owns all that it still needs
}

std::shared_ptr<const CameraInfo> Camera::info() const {
  const std::lock_guard lock(keeper_->mutex);
  return keeper_->info;
}

CameraState Camera::state() const {
  return keeper_->state.load(std::memory_order_relaxed);
}

bool Camera::isForsaken() const {
  return !keeper_->lent && rules_.clock() > keeper_->due_ns;
}

bool Camera::takeVitals(CameraVitals& vitals) {
  return keeper_->vitals.take(vitals);
}

void Camera::reopen(OpenDriver driver) {
  const std::lock_guard lock(keeper_->mutex);
  keeper_->openNext = std::move(driver);
  keeper_->refusedLast = false;
  keeper_->renewing = true;
  keeper_->changed.notify_all();
}

bool Camera::refusedLast() const {
  return keeper_->refusedLast;
}

void Camera::ask(const CameraStep& step) {
  const std::lock_guard lock(keeper_->mutex);
  if (!keeper_->lent) {
    keeper_->answer = tl::unexpected<std::string>("there is no camera now");
    return;
  }
  keeper_->question = step;
  keeper_->changed.notify_all();
}

std::optional<tl::expected<CameraReport, std::string>> Camera::takeAnswer() {
  const std::lock_guard lock(keeper_->mutex);
  return std::exchange(keeper_->answer, std::nullopt);
}

Next Camera::next(Frame& frame, milliseconds timeout) {
  if (ended_) return Next::kEnd;
  if (driver_ != nullptr && keeper_->renewing.load(std::memory_order_relaxed)) giveUp("");
  if (driver_ == nullptr && !adopt(timeout)) return ended_ ? Next::kEnd : Next::kTimeout;
  const std::int64_t patience_ns = patience();
  Buffer buffer;
  const Popped popped = driver_->pop(buffer, std::min(timeout, milliseconds(patience_ns / 4'000'000)));
  if (popped == Popped::kBuffer) {
    const Next next = judge(frame, buffer);
    if (next != Next::kFrame) {
      driver_->giveBack(buffer.handle);
      // Whole pictures of another shape: its settings were changed behind our back.
      const std::int64_t silence_ns = buffer.arrival.host_ns - lastWhole_ns_;
      if (rules_.silenceTimeout_ms > 0 && silence_ns > std::int64_t{rules_.silenceTimeout_ms} * 1'000'000 &&
          buffer.arrival.complete && !(buffer.arrival.shape == driver_->info().shape))
        giveUp("its pictures are no longer those agreed upon");
    }
    return next;
  }
  if (popped == Popped::kEnd) return end(driver_->end()), Next::kEnd;
  if (popped == Popped::kGone) return giveUp("it is no longer under our control"), Next::kTimeout;
  if (rules_.silenceTimeout_ms == 0 || driver_->info().triggered) return Next::kTimeout;
  const std::int64_t now_ns = rules_.clock();
  const bool dead = keeper_->unanswered.load(std::memory_order_relaxed) == lastArrival_ns_;
  if (dead || now_ns - lastArrival_ns_ > std::int64_t{rules_.silenceTimeout_ms} * 1'000'000) {
    driver_->markSilent();
    giveUp(dead ? keeper_->whyDoubted() : "it fell silent");
  } else if (now_ns - std::max(lastArrival_ns_, lastDoubt_ns_) > patience_ns) {
    lastDoubt_ns_ = now_ns;
    const std::lock_guard lock(keeper_->mutex);
    keeper_->doubted = lastArrival_ns_;
    keeper_->changed.notify_all();
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

Next Camera::judge(Frame& frame, const Buffer& buffer) {
  const Arrival& arrival = buffer.arrival;
  constexpr std::int64_t kForgotten = 64;  // a part in as many, with each arrival
  longest_ns_ = std::max(arrival.host_ns - lastArrival_ns_, longest_ns_ - longest_ns_ / kForgotten);
  lastArrival_ns_ = arrival.host_ns;
  const Judgement judgement = intake_.judge(buffer, *driver_, frame);
  if (judgement.outnumbered) keeper_->forged_ns.store(arrival.host_ns, std::memory_order_relaxed);
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
  std::unique_lock lock(keeper_->mutex);
  keeper_->changed.wait_for(lock, timeout, [&] { return keeper_->offered != nullptr || keeper_->done; });
  if (keeper_->offered == nullptr) {
    if (keeper_->done && keeper_->error) end(*keeper_->error);
    return false;
  }
  driver_ = std::exchange(keeper_->offered, nullptr);
  session_ = keeper_->info->session;
  lock.unlock();
  discard_ = driver_->discard();
  if (session_ > 1) ledger_.reconnects.add();
  CameraInfo info = driver_->info();
  info.session = session_;
  intake_.begin(info, rules_.buffers);
  lastArrival_ns_ = lastWhole_ns_ = rules_.clock();
  longest_ns_ = 0;
  return true;
}

void Camera::giveUp(const std::string& why) {
  driver_ = nullptr;
  const std::lock_guard lock(keeper_->mutex);
  keeper_->lostWhy = why;
  keeper_->lent = false;
  keeper_->changed.notify_all();
}

void Camera::end(Error error) {
  error_ = std::move(error);
  ended_ = true;
}

}  // namespace tractiond::capture
