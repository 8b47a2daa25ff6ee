// A record that one thread lends to another, which fills it at the next opportunity and gives it back.
#pragma once

#include <atomic>

namespace tractiond {

/// Wait-free. The owner allocates the record; the filler only writes into it, and reads one atomic while nothing is
/// lent. Atomic is replaced in interleavings_test.cpp alone.
template <typename T, template <typename> typename Atomic = std::atomic>
class Loan {
 public:
  // Called by the owner.

  /// Returns nullptr while the record is lent.
  T* own() { return lent_.load(std::memory_order_acquire) ? nullptr : &record_; }  // partner: giveBack()
  void lend() { lent_.store(true, std::memory_order_release); }                    // partner: lent()

  // Called by the filler.

  /// Returns nullptr unless the record is lent.
  T* lent() { return lent_.load(std::memory_order_acquire) ? &record_ : nullptr; }  // partner: lend()
  void giveBack() { lent_.store(false, std::memory_order_release); }                // partner: own()

 private:
  T record_;
  Atomic<bool> lent_{false};
};

}  // namespace tractiond
