// A slot through which one thread passes its newest value to another.
#pragma once

#include <atomic>
#include <utility>

namespace tractiond {

/// Wait-free. One thread calls put(), one other take() or swap(). A value that was not taken is overwritten.
template <typename T>
class Mailbox {
 public:
  /// \param room value of the empty slot, to reserve its memory
  explicit Mailbox(T room = {})
      : slot_(std::move(room)) {}

  /// Copies a value into the slot; does not allocate if the slot's T has the memory. Returns false, and changes
  /// nothing, if the other thread is taking at this moment: try again later.
  bool put(const T& value) {
    State seen = state_;
    if (seen == State::kBusy || !state_.compare_exchange_strong(seen, State::kBusy)) return false;
    slot_ = value;
    state_ = State::kFull;
    return true;
  }

  /// Copies the value out of the slot and empties it. Returns false, and leaves `value` as it is, if the slot is empty,
  /// or being written.
  bool take(T& value) {
    return empty([&] { value = slot_; });
  }

  /// Does the same as take() by swapping, which never allocates. The slot gets the memory of `value`; put() allocates
  /// if that is too small.
  bool swap(T& value) {
    return empty([&] {
      using std::swap;
      swap(value, slot_);
    });
  }

 private:
  enum class State { kEmpty, kBusy, kFull };

  template <typename Move>
  bool empty(Move&& move) {
    State full = State::kFull;
    if (!state_.compare_exchange_strong(full, State::kBusy)) return false;
    move();
    state_ = State::kEmpty;
    return true;
  }

  std::atomic<State> state_{State::kEmpty};
  T slot_;
};

}  // namespace tractiond
