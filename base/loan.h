// A record that its owner lends to another thread, which fills it at the next opportunity and gives it back.
#pragma once

#include <atomic>

namespace tractiond {

/// Wait-free, for two threads. At first the owner has the record. The owner allocates all memory of it; the filler only
/// writes into it, and reads a single atomic while nothing is wanted.
template <typename T>
class Loan {
 public:
  // For the owner.

  /// Returns the record; nullptr while it is lent.
  T* own() { return lent_ ? nullptr : &record_; }
  /// Lends the record: the owner must not touch it until own() returns it again.
  void lend() { lent_ = true; }

  // For the filler.

  /// Returns the record if it is lent; nullptr if nothing is wanted.
  T* lent() { return lent_ ? &record_ : nullptr; }
  /// Returns the filled record to the owner: the filler must not touch it until lent() returns it again. The owner is
  /// not woken.
  void giveBack() { lent_ = false; }

 private:
  T record_;
  std::atomic<bool> lent_{false};
};

}  // namespace tractiond
