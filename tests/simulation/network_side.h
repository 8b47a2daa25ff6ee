// The publisher and the control server of a life, connected to each other and the procedures as Instrument does.
#pragma once

#include "daemon/control/control_server.h"
#include "daemon/control/procedures.h"
#include "daemon/control/snapshots.h"
#include "daemon/publish/publisher.h"
#include "tests/simulation/capture_side.h"
#include "tests/simulation/gel.h"
#include "tests/simulation/statuses.h"
#include "tests/simulation/subscribers.h"

#include <memory>

namespace tractiond::simulation {

class NetworkSide {
 public:
  /// Listens, and lets the subscribers connect. All references must outlive it.
  NetworkSide(const Gel& gel, const Ledger& ledger, CaptureSide& camera, Subscribers& subscribers,
              const Starvation& starvation, Journal& journal);
  ~NetworkSide();

  /// Does what the publishing thread does with a field. Law: it reaches who reads at once.
  void publish(const TractionField& field);
  /// Does what the publishing thread does besides. Law, as in publish(): a status is true.
  void serveSubscribers();
  /// Handles requests, and answers of the camera; what else the control thread does is done by the procedures. Law: it
  /// is known whether previews are wanted.
  void control(control::Requests& requests);
  void askSnapshot() { snapshots_.ask(); }

  void describe(const RestPose& pose);
  control::Replies& replies() { return *control_; }

 private:
  void checkStatus();

  CaptureSide& camera_;
  Subscribers& subscribers_;
  const Starvation& starvation_;
  Journal& journal_;
  publish::Description description_;
  std::unique_ptr<publish::Publisher> publisher_;
  std::unique_ptr<control::ControlServer> control_;
  control::Snapshots snapshots_;
  Statuses statuses_;
  std::uint64_t statusesSoFar_ = 0;
};

}  // namespace tractiond::simulation
