// A record that its owner lends to another thread, which fills it at the next opportunity and gives it back.
#pragma once

#include <atomic>

namespace tractiond {

/// Wait-free, for two threads. At first the owner has the record. The owner allocates all memory of it; the filler only
/// writes into it, and reads a single atomic while nothing is wanted. Atomic is replaced only in
/// interleavings_test.cpp.
template <typename T, template <typename> typename Atomic = std::atomic>
class Loan {
 public:
  // For the owner.

  /// Returns the record; nullptr while it is lent.
  T* own() { return lent_.load(std::memory_order_acquire) ? nullptr : &record_; }  // partner: giveBack()
  /// Lends the record: the owner must not touch it until own() returns it again.
  void lend() { lent_.store(true, std::memory_order_release); }  // partner: lent()

  // For the filler.

  /// Returns the record if it is lent; nullptr if nothing is wanted.
  T* lent() { return lent_.load(std::memory_order_acquire) ? &record_ : nullptr; }  // partner: lend()
  /// Returns the filled record to the owner: the filler must not touch it until lent() returns it again. The owner is
  /// not woken.
  void giveBack() { lent_.store(false, std::memory_order_release); }  // partner: own()

 private:
  T record_;
  Atomic<bool> lent_{false};
};

}  // namespace tractiond
