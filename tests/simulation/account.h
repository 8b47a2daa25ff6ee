// What has become of a run's frames: the ledger's counters, summed over the daemon's lives, and the published fields.
#pragma once

#include "daemon/records/ledger.h"
#include "daemon/records/traction_field.h"

#include <array>
#include <cstdint>
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
  /// Returns the hash of all published fields: forces, moments, covariances, contacts, flags, ids and times.
  std::uint64_t hash() const { return hash_; }
  /// Returns a line for each counter that is not 0, with its name in the status, and for each flag of fields.
  std::string text() const;

 private:
  static constexpr std::size_t kCounters = 17, kFlags = 9;

  void hash(const void* bytes, std::size_t size);

  std::array<std::uint64_t, kCounters> counters_{};
  std::array<std::uint64_t, kFlags> flags_{};
  std::uint64_t fields_ = 0, valid_ = 0, hash_ = 0;
};

}  // namespace tractiond::simulation
