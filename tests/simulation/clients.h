// Clients that send requests to the control server: one at a time, many at once, without reading the answers, or
// requests that are none; and the law that each gets exactly one answer in its time.
#pragma once

#include "tests/simulation/bus.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/ongoing.h"

#include <list>
#include <memory>
#include <string>
#include <vector>

namespace tractiond::simulation {

class Clients {
 public:
  /// All references must outlive it.
  Clients(Bus& bus, const Starvation& starvation, Journal& journal);
  ~Clients();

  // Each connects a client. No effect if nobody listens.

  /// \param within_ns time within which an answer must come; kNever: any time
  void askZero(bool undo, bool anyway, std::int64_t within_ns);
  void askNoise(double seconds, std::int64_t within_ns);
  void askFinish(std::int64_t within_ns);
  void askCamera();
  void askSnapshot();
  /// Sends requests that only the network is concerned with, as the event says.
  void heed(const Happening& one);

  /// Lets those leave that have their answers, or whose time is over.
  void turn();
  /// Law: each request is answered in its time. Throws Broken.
  void check();
  /// Notes that the daemon has gone.
  void die();

 private:
  struct One;
  enum class Kind { kStatus, kDescription, kZero, kStep, kFeature, kSnapshot, kError };

  One* connect(Kind kind, std::int64_t within_ns, std::int64_t reads_bytesPerMs);
  void ask(Kind kind, const std::string& request, std::int64_t within_ns);
  void askMany(std::int64_t number, std::int64_t reads_bytesPerMs, std::int64_t stays_ns);
  void askOddly(std::int64_t how);
  std::int64_t turnsFor_ns(std::size_t requests) const;

  Bus& bus_;
  const Starvation& starvation_;
  Journal& journal_;
  std::list<std::unique_ptr<One>> all_;
};

}  // namespace tractiond::simulation
