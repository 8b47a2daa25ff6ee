// Accounts for the frames of a run: the ledger's counters, summed over the daemon's lives, and the published fields.
#pragma once

#include "daemon/records/ledger.h"
#include "daemon/records/traction_field.h"

#include <array>
#include <cstdint>
#include <map>
#include <string>

namespace tractiond::simulation {

class Account {
 public:
  /// Adds the counters of a life that has ended.
  void add(const Ledger& ledger);
  /// Adds a published field.
  void add(const TractionField& field);

  std::uint64_t fields() const { return fields_; }
  std::uint64_t valid() const { return valid_; }
  /// Returns a line for each counter that is not 0, with its name in the status, for each flag of fields,
  /// and for those that a model of an earlier frame has answered.
  std::string text() const;

 private:
  std::map<std::string, std::uint64_t> counters_;  ///< by their names in message Ledger
  std::array<std::uint64_t, 32> flags_{};          ///< number of fields, by the flag's bit
  std::uint64_t fields_ = 0, valid_ = 0, linear_ = 0;
};

}  // namespace tractiond::simulation
