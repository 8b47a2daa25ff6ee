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
/// not own the elements. Atomic is replaced only in interleavings_test.cpp.
template <typename T, std::size_t kCapacity, template <typename> typename Atomic = std::atomic>
class Ring {
  static_assert(kCapacity > 0 && (kCapacity & (kCapacity - 1)) == 0, "a power of two: the index is a mask");

 public:
  /// Adds an element. Returns false, and changes nothing, if the ring holds kCapacity elements.
  bool push(T* element) noexcept {
    const auto tail = tail_.load(std::memory_order_relaxed);  // written by this thread alone
    // acquire: partner is the release of the CAS in pop(). The taker has read the cell before we overwrite it.
    if (tail - head_.load(std::memory_order_acquire) == kCapacity) return false;
    cell(tail).store(element, std::memory_order_relaxed);  // published by the next line
    // release: partner is the acquire of tail_ in pop(). A thread that sees the new tail sees the cell and its target.
    tail_.store(tail + 1, std::memory_order_release);
    return true;
  }

  /// Returns the number of elements, for the thread that calls push(); more than there are if another thread is just
  /// taking one.
  std::size_t size() const noexcept {
    // relaxed: it reads no cell, and a pop() or push() that follows sees a head at least as new.
    return tail_.load(std::memory_order_relaxed) - head_.load(std::memory_order_relaxed);
  }

  /// Removes the oldest element and returns it; nullptr if the ring is empty.
  T* pop() noexcept {
    auto head = head_.load(std::memory_order_relaxed);  // a guess: the CAS checks it
    for (;;) {
      // acquire: partner is the release of tail_ in push(). Less than: nothing orders the two loads, so this tail may
      // be older than the head that the other taker left.
      if (tail_.load(std::memory_order_acquire) <= head) return nullptr;
      // The other taker may have been faster, and the cell overwritten: then the CAS fails, and the value is dropped.
      T* const element = cell(head).load(std::memory_order_relaxed);
      // release: partner is the acquire of head_ in push(). Failure relaxed: `head` is again only a guess.
      if (head_.compare_exchange_weak(head, head + 1, std::memory_order_release, std::memory_order_relaxed)) {
        return element;
      }
    }
  }

 private:
  Atomic<T*>& cell(std::uint64_t index) { return cells_[index & (kCapacity - 1)]; }

  // On separate cache lines: the takers write one, the producer the other.
  alignas(64) Atomic<std::uint64_t> head_{0};
  alignas(64) Atomic<std::uint64_t> tail_{0};
  alignas(64) std::array<Atomic<T*>, kCapacity> cells_{};
};

}  // namespace tractiond
