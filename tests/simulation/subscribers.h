// Subscribers: those that read at once, slowly, or nothing, and thousands; and the laws of what is sent to them.
#pragma once

#include "daemon/records/frame.h"
#include "tests/simulation/bus.h"
#include "tests/simulation/journal.h"
#include "tests/simulation/ongoing.h"

#include <array>
#include <list>
#include <memory>
#include <string>

namespace tractiond::simulation {

inline constexpr int kStreamPort = 9872, kLatestPort = 9873, kControlPort = 9874;
inline constexpr const char* kSensor = "simulation";

class Subscribers {
 public:
  /// All references must outlive it.
  Subscribers(Bus& bus, const Starvation& starvation, Journal& journal);
  ~Subscribers();

  /// Lets all that are there connect to a daemon that has begun to listen.
  void begin();
  /// Notes that the daemon has gone.
  void die();
  /// Lets subscribers come, as the event says.
  void heed(const Happening& one);
  /// Lets those connect and leave whose time it is.
  void turn();
  /// Returns when turn() has something to do; kNever: it has not.
  std::int64_t next_ns() const { return next_ns_; }

  /// Law: each field that is published reaches who reads at once, by both endpoints.
  void heedPublished(const FrameInfo& info) const;
  /// Returns the number of the last status that was read at once.
  std::uint64_t statuses() const;
  /// Returns whether a subscriber wants previews, and since when that is so.
  bool wantsPreviews() const;
  std::int64_t previewsChanged_ns() const { return previewsChanged_ns_; }
  /// Laws: a subscriber that reads is told the description and the status in time; each stays connected; one that does
  /// not read holds no more memory than promised.
  void check();

 private:
  struct One;

  void add(One one);
  void connectAll();
  void findNext();
  void toggle(One& one);
  void leave(One& one);
  void connect(One& one);
  void checkOne(One& one);

  Bus& bus_;
  const Starvation& starvation_;
  Journal& journal_;
  bool listens_ = false;
  std::int64_t next_ns_ = kNever, previewsChanged_ns_ = 0;
  std::list<std::unique_ptr<One>> all_;  ///< the first two stay: one of each endpoint
};

}  // namespace tractiond::simulation
