// Opens a camera, the first time and every later time, looks after it while it streams, and closes it.
//
// The keeper owns the driver and lends it to the capture thread, which gives it back with the reason. The two meet in
// atomics and events alone: the capture thread never waits for the keeper, whatever that waits for.
#pragma once

#include "base/background_thread.h"
#include "base/clock.h"
#include "base/event.h"
#include "base/mailbox.h"
#include "daemon/capture/driver.h"

#include <tl/expected.hpp>

#include <atomic>
#include <condition_variable>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace tractiond::capture {

struct CameraRules {
  bool wait = true;  ///< whether to wait for a camera that is not there yet; false: that is an error
  /// The camera is lost after this time in which nothing arrived (unless it is triggered), or only whole pictures of
  /// another size or format. Incomplete frames do not count as a loss. 0: only if the camera says so.
  int silenceTimeout_ms = 2000;
  int buffers = 10;                           ///< that the driver has; the frame gate remembers more pictures
  bool stills = false;                        ///< whether pictures that repeat are meant, and used
  std::chrono::milliseconds slowest{30'000};  ///< time after which a call of the driver counts as hanging
  std::int64_t (*clock)() = monotonicNow;     ///< returns the time of arrivals [ns]; waits are in real time
};

/// Called by the keeper for each session, before its first frame. Must not stop the keeper, which would wait for it.
/// After an error the camera is restored (Driver::undo()) and closed: in the first session that ends the source
/// (EX_UNAVAILABLE only without CameraRules::wait); in a later one, and while the camera is awaited, the keeper logs
/// the error and tries the camera again.
using CheckCamera = std::function<tl::expected<void, Error>(const CameraInfo&)>;

/// Why a driver is given back. kReopened: reopen() was called. kOtherPictures: its pictures differ in size or format
/// from those agreed upon. kNotControlled: Popped::kGone. kBroken: Popped::kBroken. kNoAnswer: the camera failed the
/// liveness check. kSilent: nothing arrived for CameraRules::silenceTimeout_ms.
enum class Loss { kReopened, kOtherPictures, kNotControlled, kBroken, kNoAnswer, kSilent };

/// The groups of functions below say which thread may call them.
class Keeper {
 public:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  /// Does not open the camera. The first turn() is due within CameraRules::slowest (isForsaken()).
  /// \param open opens the camera; called on the keeper's thread for each try, which it may block
  /// \param say called on it with each line for the log; may be empty
  /// \param check may be empty
  Keeper(OpenDriver open, const CameraRules& rules, Say say, CheckCamera check);

  // --- the keeper's thread

  /// Takes turns until stop() has been called and the driver has been given back.
  void run();
  /// Takes one turn: opens the camera, looks after it, or closes it. It makes at most one call of the driver that can
  /// take long, and a later turn handles the answer.
  /// \return when the next turn is due, by CameraRules::clock [ns], unless an event asks for an earlier one; 0: at
  /// once; kNever: the keeper has ended
  std::int64_t turn();

  // --- the capture thread; none of these locks, and only borrow() waits

  /// Waits at most `timeout` for a driver. Returns nullptr if there is none, at once if the keeper has ended. The
  /// driver is lent until giveBack() or stop().
  Driver* borrow(std::chrono::milliseconds timeout);
  /// Returns the session of the driver that was borrowed last.
  unsigned session() const { return session_; }
  /// Returns the driver to the keeper, which then closes it and opens the camera again. The caller must not use it any
  /// more.
  /// \param why for the log, and the error of a request that has no answer yet
  void giveBack(Loss why);
  /// Requests a liveness check of the camera (Driver::doubt()), as nothing has arrived since `arrival_ns`, by
  /// CameraRules::clock. A request during a check is dropped.
  void doubt(std::int64_t arrival_ns);
  /// Tells whether the newest picture is a repetition (Verdict::kRepeated); vitals and log say it within half a second.
  void noteRepetition(bool repeats) { repeats_.store(repeats, std::memory_order_relaxed); }
  /// Returns whether the camera has failed the liveness check that doubt(arrival_ns) requested.
  bool isUnanswered(std::int64_t arrival_ns) const { return unanswered_ == arrival_ns; }
  /// Returns whether the camera is to be given back because of reopen(): true from reopen() until the keeper begins to
  /// open the camera with the new settings, not until it is open. Any thread.
  bool isRenewing() const { return renewing_; }
  /// Returns the error with which the keeper has ended; nullptr if it has not, or was stopped without one. Lives as
  /// long as this.
  const Error* end() const;

  // --- any thread. The functions of the same names of Camera (camera.h) call these. Only awaitFirstTry(),
  // stop() and awaitEnd() may wait for the driver or for a CheckCamera.

  std::shared_ptr<const CameraInfo> info() const;  ///< Returns the newest session; nullptr if there was none.
  CameraState state() const { return state_; }     ///< Returns the camera's state.
  /// Returns whether no camera streams and the keeper hangs: its next turn is overdue, as after a call of longer than
  /// CameraRules::slowest and 1 s.
  bool isForsaken() const { return !lent_ && clock_() > due_ns_; }
  /// Copies the newest vitals. Returns false, and leaves them as they are, if none were put since the last call. For
  /// one thread.
  bool takeVitals(CameraVitals& vitals) { return vitals_.take(vitals); }
  /// Opens the camera with this driver from now on; a streaming camera is opened again once the capture thread has
  /// given it back (isRenewing()).
  void reopen(OpenDriver driver);
  /// Returns whether the camera refused the settings of the last reopen().
  bool refusedLast() const { return refusedLast_; }
  // Send a request to the camera; return its answer, once, as soon as it is there, and nothing before. Where none
  // streams, the answer is an error at once. One request at a time; for one thread.
  void ask(const CameraStep& step);
  std::optional<tl::expected<CameraReport, std::string>> takeAnswer();

  /// Waits until the first try to open the camera has ended, however long that takes. Fails with the error that ended
  /// the keeper; succeeds while the camera is still awaited.
  tl::expected<void, Error> awaitFirstTry();
  /// Requests the end of the keeper, and takes the driver from the capture thread, which must not use it any more.
  /// Neither `say` nor `check` is called after it returns; waits for one that is being called.
  void stop();
  /// Waits at most `patience` for the end of the keeper. Returns whether it has ended: run() returns, or is about to.
  bool awaitEnd(std::chrono::milliseconds patience);

 private:
  enum class Phase { kSearching, kOpened, kPausing, kStreaming, kEnded };

  /// What a call of link() or serve() returned.
  struct Answers {
    std::optional<CameraLink> link;
    std::optional<tl::expected<CameraReport, std::string>> report;
  };

  std::int64_t search();
  std::int64_t handleOpening();
  std::int64_t handleProblem(const Error& problem);
  std::optional<Error> examine(CameraInfo& seen);
  std::int64_t offer(std::shared_ptr<const CameraInfo> seen);
  std::int64_t pause();
  std::int64_t accompany();
  /// Lets calls_ send the driver a request, or ask for its link, and does not wait: however long that takes, the keeper
  /// does not count as hanging. Must not be called while `answers_` is set. Returns when the next turn is due, as
  /// turn().
  std::int64_t callAside(std::optional<CameraStep> step);
  /// Handles what the last liveness check said, which ends it, and what the call of callAside() returned, if that has
  /// ended. Does not wait for the driver; may call `say`.
  void handleAnswers();
  std::int64_t lose();
  void close(std::chrono::milliseconds patience);
  std::int64_t finish();
  void begin(std::chrono::nanoseconds longest);
  void renew();
  void refuseQuestion(const std::string& why);
  void show(CameraState now, const std::string& why);
  void showRepetition();
  void tell(LogLevel level, const std::string& line);
  void tellOf(const CameraInfo& opened);

  const CameraRules rules_;
  std::int64_t (*const clock_)();
  std::stop_source stop_;
  const std::shared_ptr<Event> wake_ = std::make_shared<Event>();  ///< wakes the keeper
  Event handed_;  ///< wakes borrow(): a driver is offered, or the keeper has ended

  // The keeper's own.
  OpenDriver open_;
  OpenDriver former_;  ///< replaced by reopen(), until the camera has been opened with the new one; else empty
  Phase phase_ = Phase::kSearching;
  std::shared_ptr<const CameraInfo> before_;  ///< the session before
  bool renewed_ = false;                      ///< the camera was given back because of reopen()
  int attempt_ = 0;
  std::int64_t nextTry_ns_ = 0, nextCheck_ns_ = 0;
  std::string told_;
  std::optional<tl::expected<std::unique_ptr<Driver>, Error>> opened_;  ///< not handled yet
  std::shared_ptr<Driver> driver_;                                      ///< shared with the calls
  std::unique_ptr<BackgroundThread> calls_;  ///< of the driver; what hangs is left behind with it
  std::shared_ptr<Answers> answers_;         ///< not handled yet, perhaps not there yet; nullptr: no call
  std::optional<std::string> doubtSaid_;     ///< not handled yet
  std::int64_t doubtedThen_ns_ = -1;         ///< arrival of the last liveness check
  std::string doubtWhy_;
  CameraVitals newest_;
  std::int64_t nextRemark_ns_ = 0;  ///< before then the log is not told again of repetitions
  CameraLink linkBefore_;           ///< of the sessions before

  // Between the threads.
  std::atomic<Driver*> offered_{nullptr};
  std::atomic<unsigned> session_{0};
  std::atomic<bool> lent_{false};  ///< the driver is offered to the capture thread, or borrowed by it
  std::atomic<Loss> loss_{Loss::kReopened};
  std::atomic<std::int64_t> doubted_{-1};     ///< arrival [ns] of the requested liveness check; -1: none
  std::atomic<std::int64_t> unanswered_{-1};  ///< arrival [ns] of the last liveness check that failed; -1: none
  std::atomic<bool> repeats_{false};
  std::atomic<std::int64_t> due_ns_{0};  ///< the keeper hangs if its next turn has not begun by then
  std::atomic<CameraState> state_{CameraState::kUnknown};
  std::atomic<bool> refusedLast_{false};
  std::atomic<bool> renewing_{false};  ///< `openNext_` is set
  std::atomic<bool> done_{false};      ///< `error_` does not change any more
  Mailbox<CameraVitals> vitals_;

  std::mutex hooksMutex_;  ///< held while one of the next two is called; taken by the keeper and stop() alone
  Say say_;                ///< empty after stop()
  CheckCamera check_;      ///< empty after stop()

  mutable std::mutex mutex_;  ///< never held while anything is waited for
  std::condition_variable changed_;
  // Guarded by it.
  OpenDriver openNext_;
  std::shared_ptr<const CameraInfo> info_;
  bool tried_ = false;  ///< the first try has ended
  std::optional<Error> error_;
  std::optional<CameraStep> question_;
  std::optional<tl::expected<CameraReport, std::string>> answer_;
};

}  // namespace tractiond::capture
