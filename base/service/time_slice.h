// Scheduling of threads that wait for messages.
#pragma once

namespace tractiond {

// Of threads of the default scheduling, whose shares of the processor stay as they were: one that is woken runs before
// those with a longer time slice. Threads that they start later inherit it. From Linux 6.12 on; others ignore it.

/// Requests the kernel's shortest time slice. \param threadId 0: the calling thread
void shortenTimeSlice(int threadId);

/// Requests a slice longer than the default for the calling thread, which computes: all who wait for messages go first.
void lengthenTimeSlice();

}  // namespace tractiond
