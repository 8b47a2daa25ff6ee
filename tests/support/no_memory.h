// Lets ZeroMQ's functions that take memory fail.
#pragma once

namespace tractiond::test {

/// Number of messages for which ZeroMQ still has memory on this thread; its functions that take more fail with ENOMEM.
/// Negative: there is no limit. A program that sets it must link traction_test_no_memory, which replaces them.
extern thread_local int memoryLeft;

}  // namespace tractiond::test
