// Counts what the marked threads do behind everybody's back: memory and locks, by whose code asks for them.
#pragma once

#include <cstdint>

namespace tractiond::interposed {

/// Calls of malloc and its kin, of free, and of pthread_mutex_lock by threads that are marked, while counting is on.
struct Counts {
  std::uint64_t allocations = 0, frees = 0, locks = 0;
};

/// From now on what this thread does is counted.
void markThisThread();
void count(bool on);

Counts ours();         ///< outside the functions of ZeroMQ and Aravis
Counts ofLibraries();  ///< within them

}  // namespace tractiond::interposed
