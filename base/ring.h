// A bounded lock-free ring of pointers that one thread fills and whose oldest element two threads may take.
//
// head_ counts the elements taken, tail_ those put in; both only grow, so a stale head_ never looks fresh again (no
// ABA). The second taker is the producer itself, which takes the oldest back when it needs room: see Link.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace tractiond {

/// push() is for one thread, pop() for any. Lock-free: a pop is retried only when another thread's pop succeeded. Does
/// not own the elements. All atomics have the default, sequentially consistent order: nothing here is called often.
template <typename T, std::size_t kCapacity>
class Ring {
  static_assert(kCapacity > 0 && (kCapacity & (kCapacity - 1)) == 0, "a power of two: the index is a mask");

 public:
  /// Adds an element. Returns false, and changes nothing, if the ring holds kCapacity elements.
  bool push(T* element) noexcept {
    const auto tail = tail_.load();
    if (tail - head_ == kCapacity) return false;
    cell(tail) = element;
    tail_ = tail + 1;  // publishes the cell and its target
    return true;
  }

  /// Returns the number of elements, for the thread that calls push(); more than there are if another thread is just
  /// taking one.
  std::size_t size() const noexcept { return tail_ - head_; }

  /// Removes the oldest element and returns it; nullptr if the ring is empty.
  T* pop() noexcept {
    auto head = head_.load();  // a guess: the exchange checks it
    while (tail_ != head) {
      // The other taker may have been faster, and the cell overwritten: then the exchange fails, and the value is
      // dropped.
      T* const element = cell(head);
      if (head_.compare_exchange_weak(head, head + 1)) return element;
    }
    return nullptr;
  }

 private:
  std::atomic<T*>& cell(std::uint64_t index) { return cells_[index & (kCapacity - 1)]; }

  // On separate cache lines: the takers write one, the producer the other.
  alignas(64) std::atomic<std::uint64_t> head_{0};
  alignas(64) std::atomic<std::uint64_t> tail_{0};
  alignas(64) std::array<std::atomic<T*>, kCapacity> cells_{};
};

}  // namespace tractiond
