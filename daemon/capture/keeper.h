// Opens a camera, the first time and every later time, looks after it while it streams, and closes it.
//
// The keeper owns the driver and lends it to the capture thread, which gives it back with the reason. The two meet in
// atomics and events alone: the capture thread never waits for the keeper, whatever that waits for.
#pragma once

#include "daemon/base/clock.h"
#include "daemon/base/event.h"
#include "daemon/base/mailbox.h"
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
  bool wait = true;              ///< for a camera that is not there yet; false: that is an error
  int silenceTimeout_ms = 2000;  ///< without a usable frame for longer the camera is lost; 0: only if it says so
  int buffers = 10;              ///< of the driver: the gate remembers more pictures than that
  std::chrono::milliseconds slowest{30'000};  ///< try to open a camera, or question to it: what takes longer hangs
  std::int64_t (*clock)() = monotonicNow;     ///< of arrivals [ns]; waits are in real time
};

/// Called by the keeper for each session, before its first frame. An error of the first session ends the source; one of
/// a later session is told, and the camera tried again.
using Welcome = std::function<tl::expected<void, Error>(const CameraInfo&)>;

/// Why a driver is given back.
enum class Loss { kReopened, kOtherPictures, kNotControlled, kNoAnswer, kSilent };

class Keeper {
 public:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::max();

  Keeper(OpenDriver open, const CameraRules& rules, Say say, Welcome welcome);

  // --- the keeper's thread

  /// Takes turns until stop() is called and the driver has been given back.
  void run();
  /// Takes one turn, which calls the driver once at most; what the driver answers is heeded by the next turn.
  /// \return when that is due [ns], or earlier if something is asked for; kNever: the keeper has ended
  std::int64_t turn();

  // --- the capture thread; all lock nothing and, but for borrow(), wait for nothing

  /// Waits at most `timeout` for a driver. \return nullptr: there is none
  Driver* borrow(std::chrono::milliseconds timeout);
  /// Returns the session of the driver that was borrowed last.
  unsigned session() const { return session_.load(std::memory_order_relaxed); }
  void giveBack(Loss why);
  /// Lets the camera be asked whether it is there, as nothing came after this arrival [ns].
  void doubt(std::int64_t arrival_ns);
  /// Returns whether it did not answer, asked so.
  bool isUnanswered(std::int64_t arrival_ns) const { return unanswered_.load(std::memory_order_relaxed) == arrival_ns; }
  /// The camera is to be opened anew.
  bool isRenewing() const { return renewing_.load(std::memory_order_relaxed); }
  /// A picture came that another host may have sent.
  void noteForgery(std::int64_t at_ns) { forged_ns_.store(at_ns, std::memory_order_relaxed); }
  /// Returns why there will be no driver any more; nullptr: there may be one.
  const Error* end() const;

  // --- any thread; none waits for the driver, or for a welcome

  std::shared_ptr<const CameraInfo> info() const;
  CameraState state() const { return state_.load(std::memory_order_relaxed); }
  bool isForsaken() const { return !lent_.load(std::memory_order_relaxed) && clock_() > due_ns_; }
  bool takeVitals(CameraVitals& vitals) { return vitals_.take(vitals); }
  void reopen(OpenDriver driver);
  bool refusedLast() const { return refusedLast_; }
  void ask(const CameraStep& step);
  std::optional<tl::expected<CameraReport, std::string>> takeAnswer();

  /// Waits until the first try to open the camera has ended. Fails with what ended the keeper.
  tl::expected<void, Error> awaitFirstTry();
  /// Lets the keeper end. Neither `say` nor `welcome` is called after that.
  void stop();
  /// \return whether run() has returned, or is about to, in time
  bool awaitEnd(std::chrono::milliseconds patience);

 private:
  enum class Phase { kSearching, kOpened, kPausing, kStreaming, kEnded };

  std::int64_t search();
  std::int64_t heedOpening();
  std::int64_t heedProblem(const Error& problem);
  std::optional<Error> examine(CameraInfo& seen);
  std::int64_t offer(std::shared_ptr<const CameraInfo> seen);
  std::int64_t pause();
  std::int64_t accompany();
  void heedAnswers();
  std::int64_t lose();
  std::int64_t finish();
  void begin(std::chrono::nanoseconds longest);
  void renew();
  void refuseQuestion(const std::string& why);
  void warnOfForgery();
  void show(CameraState now, const std::string& why);
  void tell(Weight weight, const std::string& line);
  void tellOf(const CameraInfo& opened);

  const CameraRules rules_;
  std::int64_t (*const clock_)();
  std::stop_source stop_;
  Event wake_;    ///< the keeper has something to do
  Event handed_;  ///< the capture thread has a driver to take, or will never have one

  // The keeper's own.
  OpenDriver open_;
  OpenDriver former_;  ///< what `open_` was, until the camera has been opened by it; else empty
  Phase phase_ = Phase::kSearching;
  std::shared_ptr<const CameraInfo> before_;  ///< the session before
  bool renewed_ = false;                      ///< it was given back to be opened anew
  int attempt_ = 0;
  std::int64_t nextTry_ns_ = 0, look_ns_ = 0;
  std::string told_;
  std::optional<tl::expected<std::unique_ptr<Driver>, Error>> opened_;  ///< not heeded yet
  std::unique_ptr<Driver> driver_;
  std::optional<std::string> doubtSaid_;                           ///< not heeded yet
  std::int64_t doubtedThen_ns_ = -1;                               ///< it was asked after this arrival
  std::optional<tl::expected<CameraReport, std::string>> served_;  ///< not heeded yet
  std::optional<CameraLink> linkRead_;                             ///< not heeded yet
  std::string doubtWhy_;
  CameraVitals newest_;
  CameraLink linkBefore_;       ///< of the sessions before
  std::int64_t toldOf_ns_ = 0;  ///< of `forged_ns_`

  // Between the threads.
  std::atomic<Driver*> offered_{nullptr};
  std::atomic<unsigned> session_{0};
  std::atomic<bool> lent_{false};  ///< the capture thread has the driver, or may take it
  std::atomic<Loss> loss_{Loss::kReopened};
  std::atomic<std::int64_t> doubted_{-1};     ///< nothing came after this arrival [ns]: does the camera answer?
  std::atomic<std::int64_t> unanswered_{-1};  ///< nothing came after this arrival [ns], and it is to be given up
  std::atomic<std::int64_t> forged_ns_{0};    ///< when the last picture came that may be forged; 0: none did
  std::atomic<std::int64_t> due_ns_{0};       ///< by then the keeper's next step begins, or it hangs
  std::atomic<CameraState> state_{CameraState::kUnknown};
  std::atomic<bool> refusedLast_{false};
  std::atomic<bool> renewing_{false};  ///< there is an `openNext_`
  std::atomic<bool> done_{false};      ///< `error_` does not change any more
  Mailbox<CameraVitals> vitals_;

  std::mutex hooksMutex_;  ///< held while one of them is called; not by the capture thread, nor by those who ask
  Say say_;                ///< empty once the camera is gone
  Welcome welcome_;        ///< likewise

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
