// Scheduling of threads that wait for messages.
#pragma once

namespace tractiond {

/// Requests the kernel's shortest time slice for a thread of the default scheduling: when it is woken, it runs before
/// threads with a longer one, its share of the processor being as before. Threads that it starts later inherit this.
/// From Linux 6.12 on; others ignore it.
/// \param threadId 0: the calling thread
void shortenTimeSlice(int threadId);

}  // namespace tractiond
