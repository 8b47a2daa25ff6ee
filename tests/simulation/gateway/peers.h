// Peers of a gateway: clients with and without a valid key, and the laws of which are admitted, and what each receives.
#pragma once

#include "tests/simulation/gateway/instrument.h"
#include "tests/simulation/gateway/keys.h"

#include <list>
#include <memory>
#include <string>

namespace tractiond::simulation {

/// Ports of the gateway, in the order of gateway::Way.
inline constexpr std::array<int, 4> kRemotePorts = {9882, 9883, 9884, 9885};

class RemotePeers {
 public:
  /// Adds those that are always there: a subscriber of each kind, and a client with requests. All references must
  /// outlive it.
  RemotePeers(Bus& bus, const Keys& keys, const Instrument& instrument, const Starvation& starvation, Journal& journal);
  ~RemotePeers();

  /// Lets peers come for a while, as the event says.
  void heed(const Happening& one);
  /// Lets peers connect, leave, and send whose time it is.
  void turn();
  std::int64_t next_ns() const { return next_ns_; }

  /// Notes that a gateway listens, or that it has been killed.
  void begin();
  void die();
  /// Notes that requests which are under way may stay without an answer, as the instrument has gone.
  void loseRequests();

  /// Checks the laws.
  void check();

 private:
  enum class Way : std::size_t { kStream, kLatest, kControl, kPreview };
  struct One;

  One& add(Way way, int key, std::string address, std::int64_t until_ns);
  void connect(One& one);
  void leave(One& one);
  void ask(One& one, std::int64_t number);
  void toggle(One& one);
  bool isAllowed(const One& one) const;
  bool mayBeAdmitted(const One& one) const;
  bool mustBeAdmitted(const One& one) const;
  void checkOne(One& one);
  void checkFlow(const One& one) const;
  bool wantsPreviews() const;
  void findNext();
  std::int64_t since(std::int64_t at_ns) const { return now() - at_ns - starvation_.since(at_ns); }

  Bus& bus_;
  const Keys& keys_;
  const Instrument& instrument_;
  const Starvation& starvation_;
  Journal& journal_;
  std::list<std::unique_ptr<One>> all_;
  bool listens_ = false;
  std::int64_t listens_ns_ = 0, next_ns_ = 0, previewsChanged_ns_ = 0;
  int arrivals_ = 0;  ///< so many have come
};

}  // namespace tractiond::simulation
