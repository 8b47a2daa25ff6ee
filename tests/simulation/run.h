// Runs a story from its beginning to its end.
//
// Each stage of the pipeline takes its turns when it has work and is not busy; which of those that are ready comes
// first is drawn. A stage's work takes effect at once and makes it busy for its time. Then time goes on to the next
// moment at which anything can happen.
#pragma once

#include "tests/simulation/life.h"

#include <memory>

namespace tractiond::simulation {

class Run {
 public:
  /// Begins at the time that the clocks show. Puts its own disk in the place of the daemon's. Both arguments must
  /// outlive it.
  Run(const Gel& gel, const Story& story);
  ~Run();

  /// Runs the story: moves the clocks from moment to moment. Throws Broken if a law does not hold.
  void go();

  Journal& journal() { return journal_; }

 private:
  static constexpr std::array kStages = {Stage::kCapture, Stage::kTrack, Stage::kSolve, Stage::kPublish};
  static constexpr std::size_t kControl = kStages.size(), kModelling = kControl + 1;

  std::int64_t at_ns(const Happening& one) const { return journal_.begin_ns() + one.at_ms * kMs; }
  Disk::Condition diskAt(std::int64_t at_ns) const;
  void turn();
  std::int64_t nextMoment() const;
  void happen(const Happening& one);
  void disturb(const Happening& one);
  void starve(const Happening& one);
  void start();
  void die(const char* why, bool powerIsCut = false);
  void work();
  void keep();
  void control();
  void leave();
  void stop();

  const Gel& gel_;
  const Story& story_;
  Chance chance_;
  Disk disk_;
  Journal journal_;
  Ongoing ongoing_;
  Starvation starvation_;
  Modelling modelling_;
  Camera camera_;
  Zeros zeros_;
  Askers askers_;
  Operator person_;
  StepWork stepWork_;
  Fields fields_;

  std::unique_ptr<Life> life_;
  std::int64_t waited_ns_ = 0;  ///< for the disk, until this life began
  std::int64_t startAt_ns_ = 0, controlAt_ns_ = 0, keeperAt_ns_ = 0;
  std::array<std::int64_t, kModelling + 1> busyUntil_ns_{};
  std::array<std::int64_t, kStages.size()> turned_ns_{};
  std::array<bool, kStages.size()> ready_{};
};

}  // namespace tractiond::simulation
