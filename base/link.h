// Connects two stages: a few slots travel from the producer to the consumer and back, and are reused.
//
// Two rings of slot pointers, one in each direction. If the producer finds no free slot, it takes back the oldest one
// that waits: the newest wins, every eviction is counted in one place, and no slot is lost.
#pragma once

#include "base/counter.h"
#include "base/event.h"
#include "base/ring.h"

#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <chrono>
#include <functional>
#include <utility>

namespace tractiond {

enum class WhenFull {
  kEvictOldest,  ///< live: the newest frame matters most
  kWait,         ///< replay and measurement: nothing may be lost
};

/// One producer thread, one consumer thread, kSlots elements: each side holds at most one, the others wait in the link
/// or are free. Allocates and locks nothing after construction. Atomic and Wake are replaced in interleavings_test.cpp
/// alone.
template <typename T, std::size_t kSlots, template <typename> typename Atomic = std::atomic, typename Wake = Event>
class Link {
  static_assert(kSlots >= 3, "one slot for each side and one on its way");

 public:
  /// \param blank sizes the slots \param evicted counted by the producer's thread \param reclaimed called by that
  /// thread with each slot that comes back, consumed or evicted, before it is reused
  Link(
      WhenFull whenFull, Counter& evicted, const T& blank = {}, std::function<void(T&)> reclaimed = [](T&) {})
      : whenFull_(whenFull)
      , evicted_(evicted)
      , reclaimed_(std::move(reclaimed)) {
    slots_.fill(blank);
    for (T& slot : slots_) spare_[spares_++] = &slot;
  }

  // --- called by the producer

  /// Takes back every slot that the consumer has released.
  void reclaim() {
    while (T* slot = free_.pop()) takeBack(slot);
  }

  /// Returns a slot to fill. If none is free, evicts the oldest that waits; with kWait, returns nullptr: call
  /// waitForRoom(). A slot that is not pushed must be returned with putBack().
  T* acquire() {
    for (;;) {
      reclaim();
      if (spares_ > 0) return spare_[--spares_];
      if (whenFull_ == WhenFull::kWait) return nullptr;
      // Empty here means that the consumer took the last one this moment, and so has released the one before it.
      if (T* oldest = waiting_.pop()) {
        evicted_.add();
        takeBack(oldest);
      }
    }
  }

  void push(T* slot) {
    [[maybe_unused]] const bool pushed = waiting_.push(slot);
    assert(pushed && "the ring has room for all slots");
    filled_.signal();
  }

  void putBack(T* slot) { spare_[spares_++] = slot; }

  void waitForRoom(std::chrono::milliseconds timeout) { freed_.wait(timeout); }

  /// Ends the link: nothing more may be pushed. The consumer still gets what waits.
  void close() {
    // release: partner is the acquire in drained(). A thread that sees the end sees all that was pushed before.
    closed_.store(true, std::memory_order_release);
    filled_.signal();
  }

  // --- called by the consumer

  /// Returns the oldest slot that waits; nullptr: none now.
  T* take() { return waiting_.pop(); }

  void release(T* slot) {
    [[maybe_unused]] const bool pushed = free_.push(slot);
    assert(pushed && "the ring has room for all slots");
    if (whenFull_ == WhenFull::kWait) freed_.signal();
  }

  /// Sleeps until something is pushed, the link is closed or the time is over; may wake early.
  void wait(std::chrono::milliseconds timeout) { filled_.wait(timeout); }

  // For callers that wait for more than this link: poll fd() for reading, then call awake().
  int fd() const { return filled_.fd(); }
  void awake() { filled_.clear(); }

  /// Returns whether the producer has closed the link. If it is called before take() and returns true, nullptr of
  /// take() means that all has been taken.
  bool closed() const { return closed_.load(std::memory_order_acquire); }  // partner: the release in close()

  // --- called when both threads have been joined

  /// Takes back all slots. Returns the number of those that had not been taken.
  std::size_t discard() {
    reclaim();
    std::size_t count = 0;
    for (; T* slot = waiting_.pop(); ++count) takeBack(slot);
    return count;
  }

 private:
  using Slots = Ring<T, std::bit_ceil(kSlots), Atomic>;

  void takeBack(T* slot) {
    reclaimed_(*slot);
    spare_[spares_++] = slot;
  }

  const WhenFull whenFull_;
  Counter& evicted_;
  const std::function<void(T&)> reclaimed_;
  std::array<T, kSlots> slots_;
  std::array<T*, kSlots> spare_{};  // the producer's own
  std::size_t spares_ = 0;
  Slots waiting_;  // producer -> consumer, and back to the producer when evicted
  Slots free_;     // consumer -> producer
  Wake filled_;
  Wake freed_;
  Atomic<bool> closed_{false};
};

}  // namespace tractiond
