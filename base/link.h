// Joins two stages by a few reused slots that travel from the producer to the consumer and back.
//
// Two rings of slot pointers, one in each direction. Where no more may wait, the producer takes the oldest waiting one
// back itself before it pushes: the newest wins, every eviction is counted in one place, and no slot is lost.
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

/// Queue of kSlots elements for one producer thread and one consumer thread. Each side may hold one slot, so that with
/// kEvictOldest at most kSlots - 2 wait: with three slots the consumer always takes the newest. Allocates and locks
/// nothing after construction.
template <typename T, std::size_t kSlots>
class Link {
  static_assert(kSlots >= 3, "one slot for each side and one on its way");

 public:
  /// \param evicted counts evicted elements, on the producer's thread; must outlive the link
  /// \param blank copied into each slot, to size it
  /// \param reclaimed called with each slot that comes back, consumed, evicted or discarded, before it is used again:
  /// by reclaim(), acquire(), push() and discard()
  Link(
      WhenFull whenFull, Counter& evicted, const T& blank = {}, std::function<void(T&)> reclaimed = [](T&) {})
      : whenFull_(whenFull)
      , evicted_(evicted)
      , reclaimed_(std::move(reclaimed)) {
    slots_.fill(blank);
    for (T& slot : slots_) spare_[spares_++] = &slot;
  }

  // --- called by the producer

  /// Takes back every slot that the consumer has released. acquire() does it as well.
  void reclaim() {
    while (T* slot = free_.pop()) takeBack(slot);
  }

  /// Returns a slot to fill, which holds an old element or `blank`; push() or putBack() must follow before the next
  /// acquire(). With kWait it may return nullptr, as no slot is free: see waitForRoom(). Never waits.
  T* acquire() {
    reclaim();
    assert((spares_ > 0 || whenFull_ == WhenFull::kWait) && "the consumer holds one, and kSlots - 2 wait");
    return spares_ > 0 ? spare_[--spares_] : nullptr;
  }

  /// Hands an acquired slot to the consumer and wakes it; with kEvictOldest, evicts before what has no room to wait.
  /// Does not wait. The slot must not be used afterwards.
  void push(T* slot) {
    while (whenFull_ == WhenFull::kEvictOldest && waiting_.size() >= kSlots - 2) {
      // Empty here means that the consumer took the last one this moment.
      if (T* oldest = waiting_.pop()) {
        evicted_.add();
        takeBack(oldest);
      }
    }
    [[maybe_unused]] const bool pushed = waiting_.push(slot);
    assert(pushed && "the ring has room for all slots");
    filled_.signal();
  }

  /// Gives an acquired slot back without handing it to the consumer; `reclaimed` is not called with it.
  void putBack(T* slot) { spare_[spares_++] = slot; }

  /// Sleeps until the consumer releases a slot or the time is over; it may wake early. For kWait only.
  void waitForRoom(std::chrono::milliseconds timeout) { freed_.wait(timeout); }

  /// States that nothing more will be pushed, and wakes the consumer, which still gets what waits.
  void close() {
    closed_ = true;
    filled_.signal();
  }

  // --- called by the consumer

  /// Returns the oldest waiting slot; nullptr if none waits. Does not wait. release() must follow before the next
  /// take().
  T* take() { return waiting_.pop(); }

  /// Gives a taken slot back for reuse, and with kWait wakes a producer in waitForRoom(). Does not wait.
  void release(T* slot) {
    [[maybe_unused]] const bool pushed = free_.push(slot);
    assert(pushed && "the ring has room for all slots");
    if (whenFull_ == WhenFull::kWait) freed_.signal();
  }

  /// Sleeps until something is pushed, the link is closed or the time is over; may wake early.
  void wait(std::chrono::milliseconds timeout) { filled_.wait(timeout); }

  /// Returns a descriptor that is readable when wait() would return, for a consumer that polls for more than this link.
  /// The link owns it.
  int fd() const { return filled_.fd(); }
  /// Makes fd() unreadable until the next push() or close(). Must be called after a poll of fd(), before take().
  void awake() { filled_.clear(); }

  /// Returns whether the producer has closed the link. If it is called before take(): true and then nullptr means that
  /// everything has been taken.
  bool closed() const { return closed_; }

  // --- called when both threads have been joined

  /// Takes back all slots that are still in the link. Returns the number of elements that the consumer has not taken.
  std::size_t discard() {
    reclaim();
    std::size_t count = 0;
    for (; T* slot = waiting_.pop(); ++count) takeBack(slot);
    return count;
  }

 private:
  using Slots = Ring<T, std::bit_ceil(kSlots)>;

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
  Event filled_;
  Event freed_;
  std::atomic<bool> closed_{false};
};

}  // namespace tractiond
