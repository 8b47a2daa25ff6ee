// Writes zeros to the disk: a requested one before it comes into force, and the one in force until the disk has it.
#pragma once

#include "base/error.h"
#include "daemon/control/procedure_parts.h"

#include <tl/expected.hpp>

#include <cstdint>
#include <future>
#include <optional>

namespace tractiond::control {

/// Writes one zero at a time. A requested zero whose write failed or took too long may be on the disk all the same:
/// the zero in force is due to be written over it. Thread-bound.
class ZeroWriter {
 public:
  using Written = tl::expected<void, Error>;

  /// \param clock returns the time [ns] that `until_ns` refers to
  /// \param host writes by ProcedureHost::keep(); outlives this
  ZeroWriter(std::int64_t (*clock)(), ProcedureHost& host)
      : clock_(clock)
      , host_(host) {}

  /// Starts to write a requested zero, which is refused if it is not on the disk at `until_ns`. Must not be called
  /// while isBusy().
  void writeRequested(const RestPose& zero, const RestPose* before, std::int64_t until_ns);

  /// Starts to write the zero in force, and calls turn(). Must not be called while isBusy(). \param before nullptr:
  /// none
  void writeInForce(const RestPose& zero, const RestPose* before);

  /// Ends a write that is done; does not wait. Returns the outcome of the requested zero, once: success, the error of
  /// the write, or an error with the text kNotWritten if it was not done at `until_ns`. Else returns nothing. Must be
  /// called regularly. A failed write of the zero in force is due again 10 s later; of failures in a row only the first
  /// is logged, and then the success.
  std::optional<Written> turn();

  /// Returns whether a zero is being written, or the outcome of a write has not been heeded by turn() yet.
  bool isBusy() const { return state_ != State::kIdle; }
  /// Returns whether a write has been under way for too long: a requested zero beyond its `until_ns`, the one in force
  /// for more than kWithin_ns.
  bool isStuck() const { return isBusy() && clock_() > until_ns_; }
  /// Returns whether the zero in force should be written now by writeInForce(): its last write failed 10 s ago, or a
  /// requested zero that was refused may be on the disk.
  bool isDue() const { return !isBusy() && dueAt_ns_ && clock_() >= *dueAt_ns_; }

  /// A write that takes longer is stuck [ns].
  static constexpr std::int64_t kWithin_ns = 60'000'000'000;
  /// Sentence for the operator about a zero whose write is stuck.
  static const char* const kNotWritten;

 private:
  enum class State {
    kIdle,       ///< nothing is being written
    kInForce,    ///< the zero in force is being written
    kRequested,  ///< a requested zero is being written
    kRefused,    ///< a requested zero is still being written, and was refused because that takes too long
  };

  void start(State state, const RestPose& zero, const RestPose* before, std::int64_t until_ns);
  void log(const Written& written);

  std::int64_t (*const clock_)();
  ProcedureHost& host_;
  State state_ = State::kIdle;
  std::future<Written> done_;
  std::int64_t until_ns_ = 0;
  std::optional<std::int64_t> dueAt_ns_;  ///< none: the zero in force is on the disk, or is being written
  bool isFailureLogged_ = false;
};

}  // namespace tractiond::control
