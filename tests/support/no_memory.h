// Lets ZeroMQ's functions that take memory fail.
#pragma once

namespace tractiond::test {

/// While true, ZeroMQ's functions that take memory for a message fail with ENOMEM on this thread. A program that sets it
/// must link traction_test_no_memory, which replaces them.
extern thread_local bool lacksMemory;

}  // namespace tractiond::test
