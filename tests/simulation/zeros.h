// The thread that writes zeros to the disk, and the laws of zeros: what is in force, on the disk, and restored.
#pragma once

#include "base/error.h"
#include "daemon/control/zero_store.h"
#include "tests/simulation/disk.h"
#include "tests/simulation/gel.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/later.h"

#include <tl/expected.hpp>

#include <future>
#include <map>
#include <optional>
#include <vector>

namespace tractiond::simulation {

class Zeros {
 public:
  /// All references must outlive it.
  Zeros(const Gel& gel, Disk& disk, Journal& journal);

  // What the daemon does.

  /// Notes that the daemon has compared a zero with the gel file. Law: it does so before the zero is written.
  void noteCompared(const RestPose& pose) { compared_.push_back(pose.id); }
  /// Begins to write.
  std::future<tl::expected<void, Error>> keep(const RestPose& pose, const RestPose* before);
  /// Notes that a description with this zero in force is published.
  void describe(const RestPose& pose);
  /// Reads what an earlier life has left: the zero in force and the one before.
  struct Left {
    std::optional<RestPose> zero, before;
  };
  Left restore();

  // What the world does.

  /// Ends the writing that is done.
  void turn();
  /// Returns when turn() has something to do; kNever: it has not.
  std::int64_t next_ns() const { return keeping_.next_ns(); }
  bool isIdle() const { return keeping_.isIdle(); }
  /// Returns when all writing has ended.
  std::int64_t idle_ns() const { return keeping_.idle_ns(); }
  /// Notes that the control thread has taken a turn.
  void noteTurn();
  /// Drops all writing, as the daemon was killed.
  void die() {
    keeping_.die();
    compared_.clear();
  }
  /// Notes that a zero has been taken while something pressed with that force.
  void noteTaken(const RestPose& pose, double press_N) { presses_N_[pose.id] = press_N; }
  double pressOf_N(const Id& id) const { return presses_N_.at(id); }
  /// Notes whether the last request was an undo.
  void noteAsked(bool undo) { hasUndone_ = undo; }

  const std::optional<Id>& inForce() const { return inForce_; }
  const std::optional<Id>& previous() const { return previous_; }
  std::int64_t describedAt_ns() const { return describedAt_ns_; }

 private:
  using Kept = tl::expected<void, Error>;

  control::ZeroOwner owner() const { return {gel_.sensor, PixelFormat::kRgb8, kCamera}; }
  tl::expected<std::optional<RestPose>, Error> load() const;
  /// Reads the zero that would be left if the power was lost now and all was lost that can be.
  std::optional<Id> synchronised() const;
  void check(const std::optional<RestPose>& restored);

  const Gel& gel_;
  Disk& disk_;
  Journal& journal_;
  Later<Kept> keeping_;
  std::vector<Id> compared_;
  std::map<Id, double> presses_N_;
  std::map<Id, RestPose> saved_;  ///< every zero that was to be written
  bool hasLived_ = false;
  std::optional<Id> inForce_, previous_;
  std::optional<Id> restored_;  ///< at the start of this life; it comes into force when the camera has been opened
  std::int64_t describedAt_ns_ = 0;
  std::vector<Id> unsure_;  ///< zeros that may be on the disk: of all writes since the last one that succeeded
  bool hasFailed_ = false;  ///< the last write, or what was restored is not synchronised
  bool wasKept_ = false, hasUndone_ = false;
};

}  // namespace tractiond::simulation
