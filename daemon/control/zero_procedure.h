// Processes a request for a zero: the tracker takes it, the gel file is compared with it, it is written to the disk,
// and it comes into force.
//
//   state     event                                                  next state
//   Idle      a zero is requested                                    Taking
//             an undo is requested                                   Keeping the previous zero
//   Taking    the tracker has taken the zero, which is not refused   Keeping
//             it is the first zero                                   Idle; in force at once, and written meanwhile
//             the zero is refused; no frames, or too slow            Idle
//   Keeping   the zero is on the disk                                Idle; in force
//             it could not be written                                Idle
//
// Each way back to Idle answers the request. A zero that is refused on the way leaves the previous one in force, in the
// tracker and on the disk.
#pragma once

#include "daemon/control/step_runner.h"
#include "daemon/records/frame_watch.h"

#include <tl/expected.hpp>

#include <future>
#include <optional>
#include <string>
#include <variant>

namespace tractiond::control {

/// Answers each request once, within answeredWithin_s() if the disk takes no longer than kKeptWithin_ns for a zero. A
/// request that was answered with an error changes nothing later. Thread-bound.
class ZeroProcedure {
 public:
  using Written = tl::expected<void, Error>;

  /// \param newest markers, in which the gel may recover from earlier loads; outlives this
  /// \param steps outlives this. A step that looks at frames is ended when the tracker has taken a zero that may come
  /// into force, before the comparison, and before an undo takes effect; not for the restored zero, nor again when a
  /// zero that was taken comes into force
  ZeroProcedure(const ProcedureParts& parts, const ProcedureOptions& options, const MarkerField& newest,
                StepRunner& steps)
      : parts_(parts)
      , options_(options)
      , newest_(newest)
      , steps_(steps) {}

  /// Takes over the zeros of an earlier run. Must be called once, when the camera has been opened for the first time.
  /// If there is a restored zero, compares it with the gel file, warns in the log if it seems wrong, and publishes the
  /// description.
  /// \param restored the zero of the earlier run, if there is one
  /// \param before the zero that it replaced, if there is one: an undo restores it
  void restore(const std::optional<RestPose>& restored, const std::optional<RestPose>& before);

  /// Handles a request. Must not be called while another request is open. Refuses an undo within this call if there is
  /// no previous zero; else
  /// answers in a later turn(), rarely an undo within this call. The zero comes into force when it has been written to
  /// the disk; until then the previous one stays in force. A zero is refused if it cannot be written, or if something
  /// seems to touch, or the gel recovers, and `anyway` is false. The first zero comes into force at once, also if
  /// something seems to touch: the answer then has a remark.
  void begin(const ZeroRequest& request);

  /// Answers the open request with this error and gives its zero up, unless the tracker has taken it already, or it is
  /// being written: that is then answered as usual. Has no effect without an open request.
  /// \param reason sentence for the client
  void refuse(const std::string& reason);

  /// Does what is due: handles a zero that was taken or written, and ends a request whose zero takes too long to take.
  /// Must be called in each turn of the control loop. Does not wait, but a comparison takes tens of milliseconds.
  void turn();

  /// Sets the rate of the frames [Hz], by which answeredWithin_s() and the time limits of later requests are computed;
  /// 0: not known.
  void setRate(double rate_Hz) { rate_Hz_ = rate_Hz; }
  /// Sets what the camera waits for before it sends frames, for answers that none come; empty: nothing.
  void setWaits(const std::string& waits) { waits_ = waits; }
  const std::string& waits() const { return waits_; }

  /// Returns the zero in force, if there is one. It may change in begin(), restore() and turn().
  const std::optional<RestPose>& inForce() const { return zero_; }

  /// Returns the time within which a request that comes now is answered [s], also if that is the answer of one that is
  /// open.
  double answeredWithin_s() const;

  /// Requests fail when the tracker has seen no frame for this long.
  static constexpr std::int64_t kNoFrames_ns = 5'000'000'000;
  /// Time that answeredWithin_s() allows the disk.
  static constexpr std::int64_t kKeptWithin_ns = 60'000'000'000;

 private:
  /// No request is open.
  struct Idle {};
  /// The tracker averages frames.
  struct Taking {
    std::int64_t until_ns;  ///< by then the tracker has taken the zero
    FrameWatch frames;
  };
  /// The zero has been compared with the gel file, and is being written to the disk.
  struct Keeping {
    RestPose zero;
    GelReport report;
    std::string doubt, moved;
    std::future<Written> written;
  };

  void undo();
  void handleTaken();
  void adoptFirst(const GelReport& report, const std::string& doubt);
  void logTaken(const std::string& doubt, const std::string& moved) const;
  void refuseTaken(const std::string& reason);
  void keep(Keeping keeping);
  void handleWritten();
  void putInForce(const RestPose& zero, const GelReport& report);
  void takeReport(const RestPose& zero, const GelReport& report);
  void handOver();
  void dropStep();
  void watchTaking(Taking& taking);
  /// Goes back to Idle and answers the request, which must be open.
  void answer(const tl::expected<RestPose, std::string>& result, const std::string& remark = "");
  double takenWithin_s() const;

  const ProcedureParts parts_;
  const ProcedureOptions options_;
  const MarkerField& newest_;
  StepRunner& steps_;
  double rate_Hz_ = 0.0;
  std::string waits_;

  std::optional<RestPose> zero_;  ///< in force
  std::optional<RestPose> before_;
  bool fits_ = true;          ///< the gel file fits zero_
  bool isHandedOver_ = true;  ///< to the tracker; false: tried again in the next turn
  std::variant<Idle, Taking, Keeping> state_;
  std::future<Written> ownWritten_;  ///< write of a zero that is in force already
  ZeroRequest request_;              ///< the newest
  RestPose taken_;                   ///< by the tracker
};

}  // namespace tractiond::control
