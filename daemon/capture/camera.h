// The other half of a source of pictures: is this buffer new and whole, when was it taken, and what if the camera goes
// away. The same for every driver.
//
// One thread of ours, "camera-keeper", opens the driver, the first time and every later time, looks after it while it
// streams, and closes it; next() only pops, judges and hands on.
#pragma once

#include "daemon/base/clock.h"
#include "daemon/base/mailbox.h"
#include "daemon/capture/driver.h"
#include "daemon/capture/frame_source.h"
#include "daemon/capture/intake.h"
#include "daemon/records/ledger.h"

#include <tl/expected.hpp>

#include <functional>
#include <memory>
#include <optional>
#include <thread>

namespace tractiond::capture {

struct CameraRules {
  bool wait = true;              ///< for a camera that is not there yet; false: that is an error
  int silenceTimeout_ms = 2000;  ///< without a usable frame for longer the camera is lost; 0: only if it says so
  int buffers = 10;              ///< of the driver: the gate remembers more pictures than that
  std::chrono::milliseconds slowest{30'000};  ///< try to open a camera, or question to it: what takes longer hangs
  std::int64_t (*clock)() = monotonicNow;     ///< of arrivals [ns]; waits are in real time
};

/// As a FrameSource bound to the capture thread; the functions marked so are thread-safe.
class Camera : public FrameSource {
 public:
  /// Called on the camera-keeper for each session, before its first frame. An error of the first session ends the
  /// source; one of a later session is told, and the camera tried again.
  using Welcome = std::function<tl::expected<void, Error>(const CameraInfo&)>;

  /// Returns when the first try has ended: with the camera, or without one that may be waited for, or its error. The
  /// ledger outlives the camera; `say` and `welcome` are not called after it has been destroyed.
  static tl::expected<std::unique_ptr<Camera>, Error> open(OpenDriver driver, const CameraRules& rules, Ledger& ledger,
                                                           Say say = {}, Welcome welcome = {});
  /// Takes half a second at most, whatever the camera does. Every frame must have been recycled.
  ~Camera() override;

  /// kEnd when the source has ended, or the awaited camera cannot be used: see error().
  Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override;

  /// After kEnd. EX_OK: the pictures were all there were.
  const Error& error() const { return error_; }

  /// The newest session's, with its number from 1 on; nullptr: none yet. Thread-safe.
  std::shared_ptr<const CameraInfo> info() const;

  CameraState state() const;  ///< Thread-safe.

  /// No camera streams, and the thread that is to find one hangs. Thread-safe, waits for nobody.
  bool isForsaken() const;

  /// The newest, if it has changed since it was taken last. For one thread; waits for nobody.
  bool takeVitals(CameraVitals& vitals);

  /// From now on the camera is opened so: one that streams is given back, and opened anew at once. Where the camera
  /// refuses, that is told, and it is opened as before. Any thread.
  void reopen(OpenDriver driver);

  /// It was opened as before, for it refused what reopen() asked last. Any thread.
  bool refusedLast() const;

  /// Asks the camera; the answer can be taken some time later, also where the camera is gone. One question at a time.
  /// Both for one thread.
  void ask(const CameraStep& step);
  std::optional<tl::expected<CameraReport, std::string>> takeAnswer();

 private:
  struct Keeper;
  Camera(const CameraRules& rules, Ledger& ledger, std::shared_ptr<Keeper> keeper);

  bool adopt(std::chrono::milliseconds timeout);
  Next judge(Frame& frame, const Buffer& buffer);
  std::int64_t patience() const;
  void giveUp(const std::string& why);
  void end(Error error);

  CameraRules rules_;
  Ledger& ledger_;
  Intake intake_;
  std::shared_ptr<Keeper> keeper_;  ///< shared with its thread
  std::thread keeperThread_;
  Driver* driver_ = nullptr;  ///< the keeper's, borrowed; none while it is at work
  unsigned session_ = 0;
  Driver::Discard discard_ = nullptr;
  std::int64_t lastArrival_ns_ = 0, lastWhole_ns_ = 0, lastDoubt_ns_ = 0;
  std::int64_t longest_ns_ = 0;  ///< between two arrivals lately
  bool ended_ = false;
  Error error_;
};

}  // namespace tractiond::capture
