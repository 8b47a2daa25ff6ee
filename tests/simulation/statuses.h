// The laws of what the daemon says of itself once a second.
#pragma once

#include "daemon/records/ledger.h"
#include "daemon/records/traction_field.h"
#include "tests/simulation/journal.h"

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace tractiond::simulation {

/// Checks each status against what the world knows itself: counters, rates, durations, residual, time. One for each
/// life of the daemon.
class Statuses {
 public:
  /// Begins when the publisher is opened. Both references must outlive it.
  Statuses(const Ledger& ledger, Journal& journal);

  /// Notes a field that is about to be published.
  void add(const TractionField& field);
  /// Law: a status that is being sent is true. After one that was not checked, its sums since that are not compared.
  /// \param bytes of message Status
  void check(std::string_view bytes);

 private:
  static constexpr std::size_t kStages = 4;  ///< track, solve, send, total

  void expect(const char* name, double said, double is) const;

  const Ledger& ledger_;
  Journal& journal_;
  const std::int64_t opened_ns_;
  std::uint64_t sequence_ = 1;        ///< of the last status; the publisher sends the first one when it is opened
  std::int64_t last_ns_;              ///< time of the last status
  std::uint64_t receivedBefore_ = 0;  ///< by the last status
  std::uint64_t frame_ = 0;           ///< number of the last field's frame
  // Since the last status:
  std::array<std::vector<std::int64_t>, kStages> durations_ns_;
  double residualSquares_px2_ = 0.0;
};

}  // namespace tractiond::simulation
