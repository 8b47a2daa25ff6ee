// Limits of a child that evaluates what a camera sends, and what became of it.
#pragma once

#include "base/child.h"

#include <string>

namespace tractiond::capture {

/// Limits this process for good: 1 GiB of address space beyond the present size, 5 s of processor time, no core dump,
/// no writing to files (pipes are none); the kernel ends the process when its parent ends. Limits that are lower
/// already stay. The child must call it first.
void limitChild();

/// Returns why a child gave no answer, as the end of a sentence: "crashes what evaluates it (signal 11)"; empty for
/// How::kExit.
std::string misdeed(const ChildEnd& end);

}  // namespace tractiond::capture
