#include "daemon/app/pipeline.h"

#include "base/clock.h"

#include <pthread.h>
#include <sys/resource.h>

#include <cassert>
#include <latch>
#include <memory>
#include <system_error>
#include <utility>

namespace tractiond {
namespace {

/// Passes one element of a link to `work`; if there is none, calls `sleep`, which waits for more. Returns false if the
/// link is closed and empty.
template <typename T, std::size_t kSlots, typename Work, typename Sleep>
bool workOffOne(Link<T, kSlots>& link, Work work, Sleep sleep) {
  const bool closed = link.closed();  // read before take(): a closed link that is empty then remains empty
  if (T* element = link.take()) {
    work(*element);
    link.release(element);
  } else if (closed) {
    return false;
  } else {
    sleep();
  }
  return true;
}

/// Returns a slot to fill; waits for one if the link does not evict.
template <typename T, std::size_t kSlots>
T& acquire(Link<T, kSlots>& link, Counter& turns, std::chrono::milliseconds turn) {
  for (;; turns.add()) {
    if (T* slot = link.acquire()) return *slot;
    link.waitForRoom(turn);
  }
}

}  // namespace

Pipeline::Pipeline(capture::FrameSource& source, Stages& stages, const PipelineOptions& options, Ledger& ledger,
                   Turns& turns)
    : source_(source)
    , stages_(stages)
    , options_(options)
    , ledger_(ledger)
    , turns_(turns)
    , frames_(options.whenFull, ledger.evictedBeforeTrack, {}, [this](Frame& frame) { source_.recycle(frame); })
    , markers_(options.whenFull, ledger.evictedBeforeSolve, blankMarkers(options.markers))
    , fields_(options.whenFull, ledger.evictedBeforePublish, blankField(options.markers, options.nodes)) {}

Pipeline::~Pipeline() {
  stop();
}

tl::expected<void, Error> Pipeline::start() try {
  constexpr std::ptrdiff_t kOfFrames = 4;
  auto entered = std::make_shared<std::latch>(kOfFrames);
  const auto run = [&entered, this](std::thread& thread, const char* name, bool ofFrames, auto body) {
    assert(!thread.joinable() && "started once");
    thread = std::thread([this, entered, name, body, ofFrames] {
      pthread_setname_np(pthread_self(), name);
      if (ofFrames) {
        stages_.enter();
        entered->count_down();
      }
      body();
    });
  };
  // Starts the consumers first, so that all threads run when the first frame arrives.
  if (options_.controls) run(controlThread_, "tr-control", false, [this] { loop(Stage::kControl); });
  if (options_.previews) run(previewThread_, "tr-preview", false, [this] { repeat(&Stages::preview); });
  if (options_.makesModels) run(modelThread_, "tr-model", false, [this] { repeat(&Stages::model); });
  if (options_.records) {
    run(recordThread_, "tr-record", false, [this] {
      constexpr int kNice = 10;  // of this thread only: its work is less urgent than frames
      setpriority(PRIO_PROCESS, 0, kNice);
      repeat(&Stages::record);
    });
  }
  run(publishThread_, "tr-publish", true, [this] { loop(Stage::kPublish); });
  run(solveThread_, "tr-solve", true, [this] { loop(Stage::kSolve); });
  run(trackThread_, "tr-track", true, [this] { loop(Stage::kTrack); });
  run(captureThread_, "tr-capture", true, [this] { loop(Stage::kCapture); });
  entered->wait();
  return {};
} catch (const std::system_error& error) {
  stopping_.store(true, std::memory_order_relaxed);
  join();
  return tl::unexpected(Error{.exitCode = EX_OSERR,
                              .what = std::string("a thread cannot be started: ") + error.what(),
                              .remedy = "allow more threads (TasksMax= of the service, ulimit -u) or memory"});
}

void Pipeline::stop() {
  // Orders no other memory access: capture and control see it within a turn.
  stopping_.store(true, std::memory_order_relaxed);
  finish();
}

void Pipeline::finish() {
  if (captureThread_.joinable()) join();
}

/// Joins the threads that were started.
void Pipeline::join() {
  // In the direction of the frames: each thread ends when the link before it is closed and empty. In place of one that
  // was not started, closes the link behind it.
  for (const auto& [stage, thread] :
       {std::pair(Stage::kCapture, &captureThread_), std::pair(Stage::kTrack, &trackThread_),
        std::pair(Stage::kSolve, &solveThread_), std::pair(Stage::kPublish, &publishThread_)}) {
    if (thread->joinable())
      thread->join();
    else
      loop(stage);
  }
  stopping_.store(true, std::memory_order_relaxed);
  for (std::thread* thread : {&controlThread_, &previewThread_, &modelThread_, &recordThread_}) {
    if (thread->joinable()) thread->join();
  }
  countDiscarded();
}

void Pipeline::countDiscarded() {
  ledger_.discardedAtStop.add(frames_.discard() + markers_.discard() + fields_.discard());
}

void Pipeline::loop(Stage stage) {
  while (turn(stage, options_.turn)) {
  }
}

bool Pipeline::turn(Stage stage, std::chrono::milliseconds timeout) {
  const auto take = [&](bool (Pipeline::*work)(std::chrono::milliseconds), Counter& turns) {
    const bool goesOn = (this->*work)(timeout);
    if (goesOn) turns.add();
    return goesOn;
  };
  switch (stage) {
  case Stage::kCapture:
    return take(&Pipeline::captureTurn, turns_.capture);
  case Stage::kTrack:
    return take(&Pipeline::trackTurn, turns_.track);
  case Stage::kSolve:
    return take(&Pipeline::solveTurn, turns_.solve);
  case Stage::kPublish:
    return take(&Pipeline::publishTurn, turns_.publish);
  case Stage::kControl:
    break;
  }
  return take(&Pipeline::controlTurn, turns_.control);
}

bool Pipeline::controlTurn(std::chrono::milliseconds timeout) {
  if (stopping()) return false;
  stages_.control(timeout);
  return true;
}

bool Pipeline::captureTurn(std::chrono::milliseconds timeout) {
  if (!stopping_.load(std::memory_order_relaxed)) {
    frames_.reclaim();  // returns memory to the camera, on the thread that took it
    if (!frame_) frame_ = &acquire(frames_, turns_.capture, options_.turn);
    const auto next = source_.next(*frame_, timeout);
    if (next == capture::Next::kFrame) frames_.push(std::exchange(frame_, nullptr));
    if (next != capture::Next::kEnd) return true;
    ended_.store(true, std::memory_order_release);  // partner: ended(), with all that the source has counted
  }
  if (frame_) frames_.putBack(std::exchange(frame_, nullptr));
  frames_.close();
  return false;
}

bool Pipeline::trackTurn(std::chrono::milliseconds timeout) {
  const bool goesOn = workOffOne(
      frames_,
      [this](const Frame& frame) {
        MarkerField& markers = acquire(markers_, turns_.track, options_.turn);
        markers.info = frame.info;
        const bool tracked = stages_.track(frame, markers);
        markers.info.times.tracked_ns = monotonicNow();
        if (tracked) {
          markers_.push(&markers);
        } else {
          (ledger_.*options_.notTracked).add();
          markers_.putBack(&markers);
        }
      },
      [this, timeout] { frames_.wait(timeout); });
  if (!goesOn) markers_.close();
  return goesOn;
}

bool Pipeline::solveTurn(std::chrono::milliseconds timeout) {
  const bool goesOn = workOffOne(
      markers_,
      [this](const MarkerField& markers) {
        TractionField& field = acquire(fields_, turns_.solve, options_.turn);
        stages_.solve(markers, field);
        field.markers.info.times.solved_ns = monotonicNow();
        fields_.push(&field);
      },
      [this, timeout] { markers_.wait(timeout); });
  if (!goesOn) fields_.close();
  return goesOn;
}

bool Pipeline::publishTurn(std::chrono::milliseconds timeout) {
  using std::chrono_literals::operator""ms;
  return workOffOne(
      fields_,
      [this](TractionField& field) {
        gaps_.mark(field);
        stages_.publish(field);
        ledger_.published.add();
        stages_.serveSubscribers(fields_.fd(), 0ms);  // serves new subscribers even if fields arrive without a pause
      },
      [this, timeout] {
        stages_.serveSubscribers(fields_.fd(), timeout);
        fields_.awake();
      });
}

/// Takes turns until the end.
void Pipeline::repeat(void (Stages::*function)(std::chrono::milliseconds)) const {
  while (!stopping_.load(std::memory_order_relaxed)) (stages_.*function)(options_.turn);
}

bool balanced(const Ledger& ledger) {
  return ledger.received.get() == ledger.published.get() + ledger.losses();
}

}  // namespace tractiond
