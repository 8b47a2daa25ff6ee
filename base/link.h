// What joins two stages: a few reused slots that travel from the producer to the consumer and back.
//
// Two rings of slot pointers, one in each direction. When the producer finds no free slot it takes the oldest waiting
// one back itself: newest wins, every eviction is counted in one place, and no slot is ever lost.
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

/// One producer thread, one consumer thread, kSlots elements: at most one in the hands of each side, the others wait in
/// the link or are free. Allocates and locks nothing after construction. Atomic and Wake are others only in
/// interleavings_test.cpp.
template <typename T, std::size_t kSlots, template <typename> typename Atomic = std::atomic, typename Wake = Event>
class Link {
  static_assert(kSlots >= 3, "one slot for each side and one on its way");

 public:
  /// `blank` sizes the slots. `evicted` is counted by the producer's thread. `reclaimed` is called there with each slot
  /// that comes back, consumed or evicted, before it is used again.
  Link(
      WhenFull whenFull, Counter& evicted, const T& blank = {}, std::function<void(T&)> reclaimed = [](T&) {})
      : whenFull_(whenFull)
      , evicted_(evicted)
      , reclaimed_(std::move(reclaimed)) {
    slots_.fill(blank);
    for (T& slot : slots_) spare_[spares_++] = &slot;
  }

  // --- the producer's side

  /// Takes back every slot the consumer is done with.
  void reclaim() {
    while (T* slot = free_.pop()) takeBack(slot);
  }

  /// A slot to fill. Where none is free the oldest waiting one is evicted, or, with kWait, nullptr is returned: call
  /// waitForRoom(). A slot acquired and not pushed is given back with putBack().
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

  /// Nothing more will be pushed. The consumer still gets what is waiting.
  void close() {
    // release: partner is the acquire in drained(). Who sees the end sees all that was pushed before it.
    closed_.store(true, std::memory_order_release);
    filled_.signal();
  }

  // --- the consumer's side

  /// The oldest waiting slot; nullptr: none now.
  T* take() { return waiting_.pop(); }

  void release(T* slot) {
    [[maybe_unused]] const bool pushed = free_.push(slot);
    assert(pushed && "the ring has room for all slots");
    if (whenFull_ == WhenFull::kWait) freed_.signal();
  }

  /// Sleeps until something is pushed, the link is closed or the time is over; it may wake early.
  void wait(std::chrono::milliseconds timeout) { filled_.wait(timeout); }

  /// For those who wait on more than this link: poll fd() for reading, then call awake().
  int fd() const { return filled_.fd(); }
  void awake() { filled_.clear(); }

  /// The producer has closed the link. Ask before take(): true and then nullptr means that all has been taken.
  bool closed() const { return closed_.load(std::memory_order_acquire); }  // partner: the release in close()

  // --- when both threads are joined

  /// Takes back all that is still on its way. How many had not been taken.
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
