// Runs two threads of a test in every interleaving, under a subset of the C++20 memory model.
//
// Stateless model checking, after GenMC and Relacy: the two threads are fibres of one thread; each operation on an
// explore::Atomic is a point where the other may go on; a depth-first search runs the same test once for each list of
// choices. Choices: which thread goes next, which store a load reads, whether a weak compare-and-swap fails without a
// reason. Of orders that differ only in independent operations one is run (sleep sets, Godefroid 1996).
//
// The model: a location's stores have one order, the one in which they are made. A load reads any of them that is
// neither older than one that happens before the load, nor than what an earlier load (in happens-before) has read. A
// read-modify-write that writes reads the newest. Happens-before is program order and what an acquire reads of a
// release or of its release sequence. Two accesses to an explore::Plain, one of them a write, of which none happens
// before the other, are a data race. A relaxed load may be late, as on processors that let a store overtake an older
// load: it then reads what the other thread stores after this thread's next operation, which must be a write to another
// location and must not depend on what was loaded (load buffering, of one operation).
//
// Not in the model, as the parts have no use for it: fences, sequentially consistent order, consume, three threads,
// stores that another thread orders before earlier ones, load buffering of more than one operation.
//
// Bounds: each thread re-reads an old store of a location kRereads times at most and a weak compare-and-swap fails once
// in an execution without a reason; kSpins operations without a write make the other thread go on (or all stores
// visible, where it cannot). An execution longer than kDepth operations ends there and is counted as cut.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <functional>
#include <optional>
#include <source_location>
#include <string>
#include <vector>

namespace tractiond::explore {

inline constexpr int kRereads = 1;
inline constexpr int kSpins = 24;
inline constexpr int kDepth = 300;

using Clock = std::array<std::uint32_t, 2>;

/// An operation in the source whose memory order can be weakened.
struct Site {
  const char* file = nullptr;  ///< the same pointer for the same file
  unsigned line = 0, column = 0;

  bool operator==(const Site&) const = default;
};

/// A test of two threads. Constructed anew for each execution, at the same address.
class Trial {
 public:
  virtual ~Trial() = default;
  /// The two threads. What they hold is not destroyed where an execution ends early: no locals that own memory.
  virtual void first() = 0;
  virtual void second() = 0;
  /// After both have ended and were joined.
  virtual void after() {}
};

struct Report {
  std::string violation;         ///< the law that was broken and the operations that led there; empty: none
  std::uint64_t executions = 0;  ///< that came to their end
  std::uint64_t cut = 0;         ///< that were longer than kDepth
  int depth = 0;                 ///< operations of the longest
  std::vector<Site> ordered;     ///< operations met whose order is stronger than relaxed
};

/// Runs all executions up to the first violation. `weakened` is done with relaxed order.
Report exploreAnew(const std::function<Trial&()>& make, const Site& weakened);

template <typename T>
Report explore(const Site& weakened = {}) {
  std::optional<T> trial;
  return exploreAnew([&trial]() -> Trial& { return trial.emplace(); }, weakened);
}

/// Ends the execution with a violation of `law` unless it holds.
void require(bool holds, const char* law);

/// For a thread that found nothing to do: goes on when the other thread has written something since the last time, or
/// cannot go on any more; the latter makes all stores visible, as they are in finite time. Both for ever: a violation.
void wait();

/// The memory of an atomic.
class Location {
 public:
  explicit Location(std::uint64_t initial);
  Location(const Location&) = delete;
  Location& operator=(const Location&) = delete;

  std::uint64_t load(std::memory_order order, const std::source_location& where);
  void store(std::uint64_t desired, std::memory_order order, const std::source_location& where);
  bool exchange(std::uint64_t& expected, std::uint64_t desired, std::memory_order success, std::memory_order failure,
                bool weak, const std::source_location& where);

 private:
  friend class Execution;

  struct Store {
    std::uint64_t bits;
    int thread;
    std::uint32_t time;
    Clock released;  // what an acquire that reads it knows then
  };
  struct Read {
    std::uint32_t time;
    std::size_t store;
  };

  std::size_t id_;
  std::vector<Store> stores_;               // in their order
  std::array<std::vector<Read>, 2> reads_;  // of each thread
  std::array<std::size_t, 2> oldest_{};     // that each thread may still read
  std::array<int, 2> rereads_{};            // of that one
};

/// Stands for std::atomic in what is explored. There is no default order: every one is written down.
template <typename T>
class Atomic {
  using Order = std::memory_order;
  using Where = std::source_location;

 public:
  Atomic()
      : Atomic(T{}) {}
  Atomic(T initial)
      : location_(bits(initial)) {}

  T load(Order order, Where where = Where::current()) const { return value(location_.load(order, where)); }
  void store(T desired, Order order, Where where = Where::current()) { location_.store(bits(desired), order, where); }
  bool compare_exchange_weak(T& expected, T desired, Order success, Order failure, Where where = Where::current()) {
    return exchange(expected, desired, success, failure, true, where);
  }
  bool compare_exchange_strong(T& expected, T desired, Order order, Where where = Where::current()) {
    return exchange(expected, desired, order, order, false, where);
  }

 private:
  static std::uint64_t bits(T value) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &value, sizeof value);
    return bits;
  }
  static T value(std::uint64_t bits) {
    T value{};
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  bool exchange(T& expected, T desired, Order success, Order failure, bool weak, const Where& where) {
    std::uint64_t seen = bits(expected);
    const bool done = location_.exchange(seen, bits(desired), success, failure, weak, where);
    if (!done) expected = value(seen);
    return done;
  }

  mutable Location location_;
};

/// Who has accessed a plain variable.
class Accesses {
 public:
  void read() const;
  void written();

 private:
  mutable std::array<std::uint32_t, 2> reads_{};  // when each thread did last, by its own clock
  std::array<std::uint32_t, 2> writes_{};
};

/// A variable that is no atomic: what races for it is found.
template <typename T>
class Plain {
 public:
  Plain(T value = {})
      : value_(value) {
    accesses_.written();
  }
  Plain(const Plain& other)
      : Plain(other.get()) {}
  Plain& operator=(const Plain& other) { return *this = other.get(); }
  Plain& operator=(T value) {
    accesses_.written();
    value_ = value;
    return *this;
  }
  T get() const {
    accesses_.read();
    return value_;
  }

 private:
  Accesses accesses_;
  T value_;
};

}  // namespace tractiond::explore
