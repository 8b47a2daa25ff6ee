// A run of a story of a gateway: the real relay between a double of the instrument and simulated peers.
#pragma once

#include "gateway/relay.h"
#include "tests/simulation/gateway/peers.h"

#include <functional>
#include <memory>

namespace tractiond::simulation {

class GatewayRun {
 public:
  /// The story must outlive it. Only one run exists at a time.
  explicit GatewayRun(const Story& story);
  ~GatewayRun();

  /// Throws Broken when a law is broken. \param goesOn as in Simulation::run
  void go(const std::function<bool()>& goesOn);

  Journal& journal() { return journal_; }

 private:
  void happen(const Happening& one);
  void start();
  void work();
  void turn();
  std::int64_t nextMoment() const;

  const Story& story_;
  const gateway::Config config_;
  Chance chance_;
  Journal journal_;
  Ongoing ongoing_;
  Starvation starvation_;
  Disk disk_;
  Bus bus_;
  Keys keys_;
  Instrument instrument_;
  RemotePeers peers_;
  std::unique_ptr<gateway::Relay> relay_;
  std::int64_t startAt_ns_ = 0, busyUntil_ns_ = 0, turned_ns_ = 0, checkAt_ns_ = 0;
};

}  // namespace tractiond::simulation
