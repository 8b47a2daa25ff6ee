// A number that one thread increases and any thread reads.
#pragma once

#include <atomic>
#include <cstdint>

namespace tractiond {

/// Written by one thread, read by any. Relaxed: a counter does not order other memory accesses.
class Counter {
 public:
  /// Adds n. Must only be called by one thread.
  void add(std::uint64_t n = 1) { value_.store(value_.load(std::memory_order_relaxed) + n, std::memory_order_relaxed); }
  std::uint64_t get() const { return value_.load(std::memory_order_relaxed); }  ///< Returns the number. Any thread.

 private:
  std::atomic<std::uint64_t> value_{0};
};

}  // namespace tractiond
