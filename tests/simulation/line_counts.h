// Counts what runs said, so that a test can compare it with what was recorded.
#pragma once

#include "tests/simulation/journal.h"

#include <cstdint>
#include <map>
#include <string>

namespace tractiond::simulation {

/// Counts, over some runs, each line of the log, and sums the ledger's counters, the flags of fields, and what clients
/// and subscribers have read. Words with a digit are the same: "#".
class LineCounts {
 public:
  void add(const Result& result);
  /// Returns a line for each, in alphabetical order: its count, and what was counted.
  std::string text() const;

 private:
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace tractiond::simulation
