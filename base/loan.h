// A record that one thread lends to another, which fills it at the next opportunity and gives it back.
#pragma once

#include <atomic>

namespace tractiond {

/// Wait-free. The owner makes all room; the filler only writes into it, and asks one atomic where nobody wants
/// anything. Atomic is another one only in interleavings_test.cpp.
template <typename T, template <typename> typename Atomic = std::atomic>
class Loan {
 public:
  // The owner's.

  /// Null while it is lent.
  T* own() { return lent_.load(std::memory_order_acquire) ? nullptr : &record_; }  // partner: giveBack()
  void lend() { lent_.store(true, std::memory_order_release); }                    // partner: lent()

  // The filler's.

  /// Null where nothing is wanted.
  T* lent() { return lent_.load(std::memory_order_acquire) ? &record_ : nullptr; }  // partner: lend()
  void giveBack() { lent_.store(false, std::memory_order_release); }                // partner: own()

 private:
  T record_;
  Atomic<bool> lent_{false};
};

}  // namespace tractiond
