// Tells which events of a story are still going on, and how long stages got no processor.
#pragma once

#include "tests/simulation/story.h"

#include <array>
#include <utility>
#include <vector>

namespace tractiond::simulation {

class Ongoing {
 public:
  void begin(const Happening& one) {
    amount_[indexOf(one.event)] = one.amount;
    until_ns_[indexOf(one.event)] = now() + one.for_ms * kMs;
  }
  std::int64_t until_ns(Event event) const { return until_ns_[indexOf(event)]; }
  bool lasts(Event event) const { return until_ns(event) > now(); }
  std::int64_t amountOf(Event event) const { return amount_[indexOf(event)]; }
  /// Draws whether an event that affects amountOf() of 100 frames affects the next one; false if it is over.
  bool hits(Event event, Chance& chance) const {
    return lasts(event) && static_cast<std::int64_t>(chance.below(100)) < amountOf(event);
  }

 private:
  static std::size_t indexOf(Event event) { return static_cast<std::size_t>(event); }
  std::array<std::int64_t, kEvents> until_ns_{}, amount_{};
};

/// Records how long stages got no processor, by which the laws extend their time limits.
class Starvation {
 public:
  void add(std::int64_t end_ns, std::int64_t length_ns) {
    all_.emplace_back(end_ns, length_ns);
    total_ns_ += length_ns;
  }
  std::int64_t total_ns() const { return total_ns_; }
  /// Returns the sum of the periods that had not ended at a time.
  std::int64_t since(std::int64_t at_ns) const {
    std::int64_t before_ns = 0;
    for (const auto& [end_ns, length_ns] : all_) before_ns += end_ns <= at_ns ? length_ns : 0;
    return total_ns_ - before_ns;
  }

 private:
  std::vector<std::pair<std::int64_t, std::int64_t>> all_;  // end, length
  std::int64_t total_ns_ = 0;
};

}  // namespace tractiond::simulation
