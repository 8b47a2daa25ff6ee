// One life of the daemon, from its start to its end: the real frame gate, pipeline, solver and procedures.
#pragma once

#include "daemon/capture/intake.h"
#include "daemon/pipeline.h"
#include "daemon/procedures.h"
#include "daemon/solve/solver.h"
#include "tests/simulation/askers.h"
#include "tests/simulation/fields.h"
#include "tests/simulation/tracker.h"

#include <array>
#include <vector>

namespace tractiond::simulation {

/// What a life happens in. Outlives it.
struct Around {
  const Gel& gel;
  Camera& camera;
  Zeros& zeros;
  Askers& askers;
  Fields& fields;
  Journal& journal;
  Chance& chance;
  bool searchesForContacts = false;
};

class Life : public capture::FrameSource {
 public:
  /// Restores what is on the disk.
  explicit Life(const Around& around);

  /// Takes one turn of a stage. \return whether there was something to do
  bool turn(Stage stage);
  /// Works off what is in flight, as the daemon does when it stops.
  void stop();
  /// received = published + named losses, but for what is in flight.
  void checkBalance(std::uint64_t inFlight) const;

  Procedures& procedures() { return procedures_; }
  double zeroWithin_s();
  std::uint64_t received() const { return ledger_.received.get(); }

  capture::Next next(Frame& frame, std::chrono::milliseconds timeout) override;
  void recycle(Frame& frame) override { frame.token = nullptr; }

 private:
  struct Driver : capture::Driver {
    capture::CameraInfo is;
    const capture::CameraInfo& info() const override { return is; }
    capture::Popped pop(capture::Buffer& buffer, std::chrono::milliseconds timeout) override;
    void giveBack(void* /*handle*/) override {}
    Discard discard() const override {
      return [](void*) {};
    }
  };

  solve::SolveOptions solving() const;
  Stages stages();
  ProcedureLinks links();
  bool track(const Frame& frame, MarkerField& markers);

  Around around_;
  Ledger ledger_;
  Turns turns_;
  Driver driver_;
  solve::Solver solver_;
  Tracker tracker_;
  static constexpr std::size_t kPictures = 256, kNumbers = 4096;  // more than are in flight
  std::array<Picture, kPictures> pictures_;
  std::size_t nextPicture_ = 0;
  std::vector<Truth> truths_;  ///< by numbers of frames
  capture::Intake intake_;
  Counter frames_;
  Mailbox<MarkerField> newest_;
  Mailbox<Watched> watched_;
  Watched lastWatched_;
  Pipeline pipeline_;
  Procedures procedures_;
  bool worked_ = false;  ///< the stage that takes its turn has something to do
};

}  // namespace tractiond::simulation
