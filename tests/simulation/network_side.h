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

#include <functional>
#include <memory>

namespace tractiond::simulation {

class NetworkSide {
 public:
  /// What requests begin.
  struct Requests {
    std::function<void(const ZeroRequest&)> zero;
    std::function<void(const CalibrationStep&)> calibrate;
  };

  /// Listens, and lets the subscribers connect. All references must outlive it.
  NetworkSide(const Gel& gel, const Ledger& ledger, CaptureSide& camera, Subscribers& subscribers,
              const Starvation& starvation, Journal& journal, Requests requests);
  ~NetworkSide();

  /// Does what the publishing thread does with a field. Law: it reaches who reads at once.
  void publish(const TractionField& field);
  /// Does what the publishing thread does besides. Law, as in publish(): a status is true.
  void serveSubscribers();
  /// Handles requests, and answers of the camera; what else the control thread does is done by the procedures. Law: it
  /// is known whether previews are wanted.
  void control();

  void describe(const RestPose& pose);
  void answerZero(const tl::expected<RestPose, std::string>& result, const std::string& remark) {
    control_->answerZero(result, remark);
  }
  void answerStep(const calibrate::Result& result) { control_->answerCalibration(result); }

 private:
  void checkStatus();

  CaptureSide& camera_;
  Subscribers& subscribers_;
  const Starvation& starvation_;
  Journal& journal_;
  publish::Description description_;
  Snapshots snapshots_;
  std::unique_ptr<publish::Publisher> publisher_;
  std::unique_ptr<publish::ControlServer> control_;
  Statuses statuses_;
  std::uint64_t statusesSoFar_ = 0;
};

}  // namespace tractiond::simulation
